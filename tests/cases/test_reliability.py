"""Probabilities of failure in closed form: a frequency, a bearing load, a paraboloid."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.design import percentile, polynomial_chaos, propagate_uncertainty, reliability
from jaxmbs.probability import LogNormal, Normal, Uniform

# Case UQ1, "reliability in closed form": probabilities and derivatives of lognormal products, the paraboloid by
# quadrature; an independent program (OpenTURNS 1.27) gives the same indices.
OSCILLATOR = {"stiffness": LogNormal(2e5, 2e4), "mass": LogNormal(5.0, 0.25)}  # [N/m], [kg]
ROTOR = {"mass": LogNormal(4.0, 0.12), "centre": LogNormal(0.35, 0.007), "speed": LogNormal(12.0, 0.72)}


def above_28_hertz(x):
    return jnp.sqrt(x["stiffness"] / x["mass"]) / (2.0 * jnp.pi) - 28.0


def bearing(x):
    """Load [N] of an unbalanced rotor."""
    return x["mass"] * x["centre"] * x["speed"] ** 2


def paraboloid(x):
    return 3.0 - x["a"] + (0.4 * x["b"] ** 2 - 0.2 * x["c"] ** 2) / 2.0


NORMAL = {name: Normal(0.0, 1.0) for name in "abc"}


def test_frequency():
    """Derivatives of the file are at a constant coefficient of variation: 0.1 of the stiffness, 0.05 of the mass."""
    found = reliability(above_28_hertz, OSCILLATOR)
    assert found.ok and found.gradients <= 5
    np.testing.assert_allclose(found.probability, 0.011743848293301086, rtol=1e-9)
    np.testing.assert_allclose(found.index, 2.2654073032, rtol=1e-9)
    np.testing.assert_allclose(found.importances["stiffness"], 0.7994024373648707, rtol=1e-9)
    by = {
        name: row["mean"] + cov * row["deviation"]
        for (name, row), cov in zip(found.derivatives.items(), (0.1, 0.05), strict=True)
    }
    np.testing.assert_allclose(by["stiffness"], -1.3738178296662645e-06, rtol=1e-8)
    np.testing.assert_allclose(by["mass"], 0.054952713186650584, rtol=1e-8)

    frequency = lambda x: above_28_hertz(x) + 28.0
    np.testing.assert_allclose(percentile(frequency, OSCILLATOR, 1.0), 27.904976154521325, rtol=1e-9)


def test_bearing_load():
    wanted = {220.0: 0.23222338637258516, 260.0: 0.019418917683466246, 320.0: 9.787639191182863e-05}
    for limit, probability in wanted.items():
        found = reliability(lambda x, limit=limit: limit - bearing(x), ROTOR)
        assert found.ok
        np.testing.assert_allclose(found.probability, probability, rtol=1e-9)


def test_paraboloid():
    first, second = (reliability(paraboloid, NORMAL, method) for method in ("form", "sorm"))
    np.testing.assert_allclose(first.probability, 0.0013498980316300933, rtol=1e-10)
    np.testing.assert_allclose(second.curvatures, [0.4, -0.2], atol=1e-12)
    np.testing.assert_allclose(second.second_order["breitung"], 0.0014389961367528219, rtol=1e-9)
    np.testing.assert_allclose(second.probability, 0.0014090755058629423, rtol=1e-7)  # exact
    assert first.ok and second.ok


@pytest.mark.slow
def test_scatter_of_the_bearing_load():
    """Mean and deviation of a product of powers of lognormal numbers, and the deviation to first order."""
    found = polynomial_chaos(bearing, ROTOR, tolerance=1e-9)
    assert found.ok
    np.testing.assert_allclose(found.mean, 202.32575999999997, rtol=1e-10)
    np.testing.assert_allclose(found.deviation, 25.429646457218094, rtol=1e-10)
    means, deviations = (
        {"mass": 4.0, "centre": 0.35, "speed": 12.0},
        {"mass": 0.12, "centre": 0.007, "speed": 0.72},
    )
    first = propagate_uncertainty(bearing, means, deviations)
    np.testing.assert_allclose(first.deviation, 25.2604075976616, rtol=1e-10)


@pytest.mark.long
def test_shares_of_ishigami():
    """Ishigami and Homma 1990, shares in closed form."""
    function = lambda x: jnp.sin(x["a"]) * (1.0 + 0.1 * x["c"] ** 4) + 7.0 * jnp.sin(x["b"]) ** 2
    found = polynomial_chaos(function, {name: Uniform(-np.pi, np.pi) for name in "abc"}, 1e-7)
    assert found.ok
    np.testing.assert_allclose(found.deviation**2, 13.844587940719254, rtol=1e-10)
    np.testing.assert_allclose(found.first["a"], 0.31390519114781146, rtol=1e-10)
    np.testing.assert_allclose(found.first["b"], 0.4424111447900409, rtol=1e-10)
    np.testing.assert_allclose(found.pairs["a", "c"], 0.24368366406214773, rtol=1e-10)
    np.testing.assert_allclose(found.total["a"], 0.5575888552099592, rtol=1e-10)
