"""MF 6.1 and 6.2 against public programs; conventions; mirrored tyres; small loads."""

import json
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import vehicles
from jaxmbs.vehicles import MagicFormula, Slip

from .tyres import WHOLE

PUBLIC = json.loads((Path(__file__).parent / "mf_6_1_public.json").read_text())


def slip_of(row):
    load, pressure, gamma, kappa, alpha, last = row[:6]
    return Slip(load, kappa, jnp.tan(alpha), jnp.sin(gamma), last, pressure)


@mbs.jit
def answers(model, slip):
    return model.pure_forces(slip), model.forces(slip), model.rolling_radius(slip.load, slip.speed, slip.pressure)


def test_forces_of_a_public_program_with_pressure_and_camber():
    """BrianN92/Pacejka-tire-model, MF 6.1: pure and combined forces, effective rolling radius, to 1e-12."""
    case = PUBLIC["BrianN92/Pacejka-tire-model"]
    model = MagicFormula(case["coefficients"], "6.1", "mfeval")
    for row in case["rows"]:  # its sixth number is the spin
        pure, whole, radius = answers(model, slip_of(row))
        found = [pure.fx, pure.fy, whole.fx, whole.fy, radius]
        np.testing.assert_allclose(found, row[6:], rtol=1e-12)


def test_moments_of_a_public_program_with_pressure_and_camber():
    """matheusft/MFeval_julia, MF 6.2: combined forces and all three moments, to 1e-12."""
    case = PUBLIC["matheusft/MFeval_julia"]
    model = MagicFormula(case["coefficients"], "6.2", "mfeval")
    for row in case["rows"]:
        np.testing.assert_allclose(answers(model, slip_of(row))[1], row[6:], rtol=1e-12)


@pytest.mark.slow
def test_slopes_by_slip_load_camber_pressure_and_every_coefficient():
    case = PUBLIC["matheusft/MFeval_julia"]
    model = MagicFormula(case["coefficients"], "6.2")
    slip = jax.tree.map(jnp.asarray, Slip(3000.0, 0.05, 0.06, 0.03, 20.0, 2e5, 1.0))
    weights = jnp.array([1.0, 1.0, 7.0, 11.0, 13.0])

    @mbs.jit
    def both(model, slip, along):
        def whole(model, slip):
            return weights @ jnp.stack(model.forces(slip))

        return jax.grad(whole, argnums=(0, 1))(model, slip), jax.jvp(whole, (model, slip), along)[1]

    rng = np.random.default_rng(0)
    along = jax.tree.map(lambda x: jnp.asarray(rng.normal() * (abs(x) + 0.1)), (model, slip))
    slopes, forward = both(model, slip, along)
    by_hand = sum(jnp.vdot(a, b) for a, b in zip(*map(jax.tree.leaves, (slopes, along)), strict=True))
    np.testing.assert_allclose(by_hand, forward, rtol=1e-10)
    h = 1e-6
    up, down = (jax.tree.map(lambda x, d, s=s: x + s * h * d, (model, slip), along) for s in (1, -1))
    difference = [weights @ np.array(answers(*at)[1]) for at in (up, down)]
    np.testing.assert_allclose(forward, (difference[0] - difference[1]) / (2 * h), rtol=1e-6)
    assert set(slopes[0].coefficients) == set(case["coefficients"])


def test_a_mirrored_tyre_is_the_image_of_the_other():
    left, right = MagicFormula(WHOLE, "5.2"), MagicFormula(WHOLE, "5.2", mirrored=True)
    at, image = Slip(4000.0, 0.03, 0.05, 0.04), Slip(4000.0, 0.03, -0.05, -0.04)
    sign = np.array([1.0, -1.0, -1.0, 1.0, -1.0])
    np.testing.assert_allclose(np.array(right.forces(image)), sign * np.array(left.forces(at)), rtol=1e-13)


@pytest.mark.slow
def test_forces_vanish_with_the_load_and_slopes_are_finite():
    model = MagicFormula(WHOLE, "5.2")

    def force(load, kappa, tangent):
        return jnp.stack(model.forces(Slip(load, kappa, tangent, 0.0)))

    np.testing.assert_array_equal(force(0.0, 0.1, 0.1), 0.0)
    small = np.asarray(force(1.0, 0.1, 0.1))[[0, 1, 3, 4]] / np.asarray(force(2.0, 0.1, 0.1))[[0, 1, 3, 4]]
    np.testing.assert_allclose(small, 0.5, rtol=1e-12)
    for at in ((0.0, 0.0, 0.0), (4000.0, 0.0, 0.0), (4000.0, -1.0, 0.0)):
        assert all(np.all(np.isfinite(x)) for x in jax.jacfwd(force, (0, 1, 2))(*at))


def test_relaxation_lengths_of_both_kinds():
    """MF 5.2 by its own formula, published sign of PTX3 and Chrono's; MF 6.1 stiffness over stiffness."""
    dfz = 3000.0 / 4850.0 - 1.0
    plain = 3000.0 * (2.3657 + 1.4112 * dfz) * 0.344 / 4850.0
    for convention, sign in (("pacejka", -1.0), ("chrono", 1.0)):
        along, across = MagicFormula(WHOLE, "5.2", convention).relaxation_lengths(Slip(3000.0))
        np.testing.assert_allclose(along, plain * np.exp(sign * 0.56626 * dfz), rtol=1e-12)
    np.testing.assert_allclose(across, 2.1439 * np.sin(2 * np.arctan(3000.0 / (1.9829 * 4850.0))) * 0.344, rtol=1e-12)
    stiff = {"LONGITUDINAL_STIFFNESS": 3e5, "LATERAL_STIFFNESS": 1.5e5}
    model = MagicFormula(PUBLIC["matheusft/MFeval_julia"]["coefficients"] | stiff, "6.1")
    slopes = model.slopes(Slip(3000.0))
    np.testing.assert_allclose(
        model.relaxation_lengths(Slip(3000.0)), [slopes[0] / 3e5, slopes[1] / 1.5e5], rtol=1e-12
    )


def test_load_of_a_compression():
    """The stiffness of the file is the slope at the nominal load; speed stiffens, forces soften; camber of MF 6.2."""
    own = {"VERTICAL_STIFFNESS": 2e5, "Q_FZ2": 10.0, "Q_V2": 0.05, "Q_FCX": 0.2, "Q_FCY": 0.3, "LONGVL": 16.7}
    model = MagicFormula(WHOLE | own, "5.2")
    load = lambda x, **rest: model.load(vehicles.Compression(jnp.asarray(x), **rest))
    at = 0.02
    for _ in range(20):
        at = at + (4850.0 - load(at)) / jax.grad(load)(at)
    np.testing.assert_allclose(jax.grad(load)(at), 2e5, rtol=1e-9)
    factor = 1 + 0.05 * 0.344 / 16.7 * 60 - (0.2 * 2000 / 4850) ** 2 - (0.3 * -3000 / 4850) ** 2
    np.testing.assert_allclose(load(at, spin=60.0, fx=2000.0, fy=-3000.0), 4850.0 * factor, rtol=1e-12)
    assert model.load_follows_forces and not MagicFormula(WHOLE, "5.2").load_follows_forces
    leaned = {"Q_CAM1": 1.0, "WIDTH": 0.235, "ASPECT_RATIO": 0.6}
    found = MagicFormula(WHOLE | leaned, "6.2").load(vehicles.Compression(0.02, camber=np.sin(0.05)))
    more = (0.324 / 0.344) ** 2
    np.testing.assert_allclose(found, 2e5 * (0.02 + more * (1.075 - 0.3) * 0.235 / 8 * np.tan(0.05)), rtol=1e-12)
    assert load(-0.01) == 0.0


def test_ranges_are_told():
    model = MagicFormula(WHOLE | {"FZMAX": 9000.0, "KPUMIN": -0.8, "KPUMAX": 0.9, "ALPMAX": 0.3}, "5.2")
    margins = model.validity(Slip(jnp.asarray(8000.0), jnp.asarray(1.0), jnp.tan(0.2), jnp.asarray(0.0)))
    np.testing.assert_allclose([margins[name].value for name in ("load", "slip", "slip angle")], [1000.0, -0.1, 0.1])
    assert set(margins) == {"load", "slip", "slip angle"}


def test_wrong_models_are_refused():
    with pytest.raises(ValueError, match="PKY1"):
        MagicFormula(WHOLE | {"PKYY1": 1.0}, "5.2")
    with pytest.raises(ValueError, match="fit"):
        MagicFormula(WHOLE, "5.3")
    with pytest.raises(ValueError, match="evaluates no MF 6.1"):
        MagicFormula(WHOLE, "6.1", "opentire")
    assert "PKY2" in MagicFormula({k: v for k, v in WHOLE.items() if k != "PKY2"}, "5.2").faults()[0]
    assert MagicFormula(WHOLE | {"FNOMIN": 0.0}, "5.2").faults() == ["FNOMIN must be positive"]
