"""Linear, Fiala's and the brush tyre against their closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.vehicles import BrushTyre, FialaTyre, LinearTyre, Slip, Tyre

NUMBERS = {"nominal_load": 4000.0, "radius": 0.3, "stiffness": 2e5}
KINDS = {"linear": LinearTyre, "Fiala": FialaTyre, "brush": BrushTyre}


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_slopes_at_small_slips(kind):
    model = KINDS[kind](9e4, 6e4, **NUMBERS)
    across = jax.grad(lambda x: model.forces(Slip(3000.0, 0.0, x)).fy)(1e-7)
    along = jax.grad(lambda x: model.forces(Slip(3000.0, x, 0.0)).fx)(1e-7)
    slopes = model.slopes(Slip(3000.0))
    np.testing.assert_allclose([along, -across], slopes[:2], rtol=1e-5)
    np.testing.assert_allclose(slopes[1], 6e4 * 0.75)


def test_linear_tyre():
    model = LinearTyre(9e4, 6e4, camber_stiffness=-3e3, trail=0.03, **NUMBERS)
    found = model.forces(Slip(2000.0, 0.01, 0.02, 0.1))
    np.testing.assert_allclose(found.fx, 450.0)
    np.testing.assert_allclose(found.fy, -600.0 - 150.0)
    np.testing.assert_allclose(found.mz, 600.0 * 0.03)


def test_brush_tyre_slides_at_last_and_its_trail_starts_at_a_third():
    model = BrushTyre(6e4, 6e4, friction=0.9, half_length=0.06, **NUMBERS)
    theta = 6e4 / (3 * 0.9 * 4000.0)
    y = 0.5 / theta
    found = model.forces(Slip(4000.0, 0.0, y))
    np.testing.assert_allclose(found.fy, -0.9 * 4000.0 * (3 * 0.5 - 3 * 0.25 + 0.125), rtol=1e-12)
    np.testing.assert_allclose(found.mz, -found.fy * 0.06 / 3 * 0.125 / (1 - 0.5 + 0.25 / 3), rtol=1e-12)
    sliding = model.forces(Slip(4000.0, -0.6, 0.5))
    np.testing.assert_allclose(np.hypot(sliding.fx, sliding.fy), 3600.0, rtol=1e-12)
    np.testing.assert_allclose(sliding.fx / sliding.fy, -0.6 / -0.5, rtol=1e-12)
    assert sliding.mz == 0.0


def test_fiala_tyre():
    model = FialaTyre(9e4, 6e4, friction=(1.0, 0.8), width=0.2, **NUMBERS)
    mu = 1.0 - 0.2 * 0.05
    h = 1.0 - 6e4 * 0.05 / (3 * mu * 4000.0)
    found = model.forces(Slip(4000.0, 0.0, 0.05))
    np.testing.assert_allclose(found.fy, -mu * 4000.0 * (1 - h**3), rtol=1e-12)
    np.testing.assert_allclose(found.mz, mu * 4000.0 * 0.2 * (1 - h) * h**3, rtol=1e-12)
    driving = model.forces(Slip(4000.0, 0.3, 0.0)).fx
    limit = (1.0 - 0.2 * 0.3) * 4000.0
    np.testing.assert_allclose(driving, limit - limit**2 / (4 * 0.3 * 9e4), rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_slopes_are_finite_everywhere(kind):
    model = KINDS[kind](9e4, 6e4, **NUMBERS)
    places = jnp.array([[4000.0, 0.0, 0.0], [0.0, 0.0, 0.0], [4000.0, -1.0, 0.0], [4000.0, 0.0, 5.0]])
    slopes = jax.vmap(jax.jacfwd(lambda x: jnp.stack(model.forces(Slip(x[0], x[1], x[2])))))(places)
    assert np.all(np.isfinite(slopes))


def test_fiala_tyre_tells_where_it_pushes_beyond_its_friction():
    """Braked and at a slip angle at once: 5.1 kN of a friction of 3.6 kN; sliding one way alone is no fault."""
    model = FialaTyre(9e4, 6e4, **NUMBERS)
    left = lambda *slip: float(model.validity(Slip(*slip))["friction"].value)
    both = np.hypot(*model.forces(Slip(4000.0, -1.0, 1.0))[:2])
    np.testing.assert_allclose(left(4000.0, -1.0, 1.0), 3600.0 - both, rtol=1e-5)
    assert both > 5000.0
    for slip in ((4000.0, -1.0, 0.0), (4000.0, 0.0, 3.0), (4000.0, 0.01, 0.01), (0.0, 0.0, 0.0)):
        assert left(*slip) > 0.0


def test_wrong_numbers_are_refused():
    assert LinearTyre(-9e4, 6e4, **NUMBERS).faults() == ["slip_slope must be positive"]
    assert BrushTyre(9e4, 6e4, friction=0.0, **NUMBERS).faults() == ["friction must be positive"]
    assert "relaxation" in Tyre(LinearTyre(9e4, 6e4, relaxation=(0.0, 0.5), **NUMBERS)).faults()[0]
    with pytest.raises(TypeError, match="model must be an AbstractTyreModel"):
        Tyre(0.3)
