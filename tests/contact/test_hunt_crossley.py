"""The normal force by itself: restitution, smooth depth, stiffness of Hertz."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq

from jaxmbs.contact import HuntCrossley, hertz_stiffness


@pytest.mark.long
def test_restitution_of_the_first_integral():
    integral = lambda a, v: v / a - np.log1p(a * v) / a**2
    for a, v in ((0.2, 0.8), (0.6, 0.8), (0.02, 0.5), (5.0, 3.0)):
        left = brentq(lambda u, a=a, v=v: integral(a, -u) - integral(a, v), 1e-9, (1 - 1e-12) / a)
        np.testing.assert_allclose(HuntCrossley(1.0, damping=a).restitution(v), left / v, rtol=1e-8)
    few = HuntCrossley(1.0, damping=1e-3)
    np.testing.assert_allclose(
        few.restitution([0.0999, 0.1001, 0.0]), [1 - 0.0666e-3, 1 - 0.06673e-3, 1.0], rtol=1e-8
    )
    slope = jax.grad(lambda a: HuntCrossley(1.0, damping=a).restitution(0.8))(0.2)
    ahead, back = (HuntCrossley(1.0, damping=0.2 + h).restitution(0.8) for h in (1e-5, -1e-5))
    np.testing.assert_allclose(slope, (ahead - back) / 2e-5, rtol=1e-8)


@pytest.mark.long
def test_force_is_the_slope_of_the_energy_and_smooth():
    for n, width in ((1.0, 1e-3), (1.5, 1e-3), (1.5, 0.0), (2.0, 0.0)):
        law = HuntCrossley(1e5, n, 0.4, width)
        d = jnp.linspace(-1e-3, 3e-3, 41)
        energy_slope = jax.vmap(jax.grad(law.energy))(d)
        np.testing.assert_allclose(jax.vmap(law.force)(d, 0.0 * d), energy_slope, rtol=1e-12, atol=1e-12)
        np.testing.assert_array_equal(energy_slope[d <= 0], 0.0)
        edges = jnp.array([0.0, width])
        second = jax.vmap(jax.grad(lambda x, law=law: law.force(x, 0.0)))
        assert width == 0.0 or np.all(np.abs(second(edges + 1e-9) - second(edges - 1e-9)) < 1e-3 * second(d).max())
    deep = HuntCrossley(1e5, 1.0, transition=1e-3)
    np.testing.assert_allclose(deep.force(5e-3, 0.0), 1e5 * 4.5e-3)


@pytest.mark.long
def test_the_force_never_pulls():
    law = HuntCrossley(1e5, damping=2.0)
    rates = jnp.linspace(-3.0, 1.0, 401)
    force = jax.vmap(lambda v: law.force(1e-3, v))(rates)
    plain = 1e5 * 1e-3**1.5 * (1.0 + 2.0 * np.asarray(rates))
    assert force.min() == 0.0
    np.testing.assert_allclose(force[plain > 0.2], plain[plain > 0.2])
    assert np.all((np.asarray(force) - 1e5 * 1e-3**1.5) * np.asarray(rates) >= 0.0)


@pytest.mark.long
def test_derivatives_by_parameters():
    def force(k, n, a, w):
        return jnp.stack([HuntCrossley(k, n, a, w).force(d, 0.3) for d in (-1e-3, 0.0, 1e-4, 2e-3)])

    at = (2e5, 1.4, 0.3, 5e-4)
    for i, h in enumerate((1.0, 1e-5, 1e-5, 1e-8)):
        ahead, back = ([x + s * h * (j == i) for j, x in enumerate(at)] for s in (1, -1))
        found = jax.jacfwd(force, i)(*map(jnp.asarray, at))
        np.testing.assert_allclose(found, (force(*ahead) - force(*back)) / (2 * h), rtol=1e-6, atol=1e-9)


def test_stiffness_of_hertz():
    """Timoshenko: a ball of 10 mm on a plate of the same steel, 100 N: approach 2.2966e-6 m times 1.0."""
    k = float(hertz_stiffness((0.01, np.inf), (2e11, 2e11), (0.3, 0.3)))
    softness = 2.0 * 0.91 / 2e11
    np.testing.assert_allclose((100.0 / k) ** (2 / 3), (9.0 * (100.0 * softness) ** 2 / (16.0 * 0.01)) ** (1 / 3))
    np.testing.assert_allclose(hertz_stiffness((0.01, -0.02), (2e11, np.inf), (0.3, 0.3)), k * 2.0 * np.sqrt(2.0))
    for radii, moduli, poisson in (
        ((0.02, -0.01), (1, 1), (0, 0)),
        ((1, 1), (-1, 1), (0, 0)),
        ((1, 1), (1, 1), (0.7, 0)),
    ):
        with pytest.raises(ValueError, match="must be positive|from -1 to 0.5"):
            hertz_stiffness(radii, moduli, poisson)
