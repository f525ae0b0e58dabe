"""Mean, deviation and percentile as objectives: closed forms, derivatives, optima."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import ndtri

import jaxmbs as mbs
from jaxmbs.design import Robust, moments
from jaxmbs.probability import Normal, RandomVariables, Uniform


@pytest.mark.slow
def test_moments_in_closed_form():
    """Of `a^2 + k b` with a normal and a uniform number, and their derivatives by k and the mean of a."""

    def both(x):
        return jnp.stack(
            moments(
                lambda n: n["a"] ** 2 + x[0] * n["b"],
                {"a": Normal(x[1], 0.5), "b": Uniform(0.0, 2.0)},
                compile="tape",
            )
        )

    def wanted(x):
        variance = 4.0 * x[1] ** 2 * 0.25 + 2.0 * 0.0625 + x[0] ** 2 / 3.0
        return jnp.stack([x[1] ** 2 + 0.25 + x[0], jnp.sqrt(variance)])

    x = jnp.array([0.7, 1.2])
    np.testing.assert_allclose(both(x), wanted(x), rtol=1e-12)
    slopes = mbs.jit(jax.jacrev(both), compile="tape")(x)
    np.testing.assert_allclose(slopes, jax.jacfwd(wanted)(x), rtol=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("weights", [{"deviation": 2.0}, {"percent": 97.5}])
def test_a_robust_optimum(weights):
    """Least mean and deviations of `(d - 1)^2 + s d` with a normal s: a parabola in closed form."""
    lifted = weights.get("deviation", ndtri(0.975)) * 0.5
    objective = Robust(lambda d, x: (d - 1.0) ** 2 + x["s"] * d, {"s": Normal(0.0, 0.5)}, **weights)
    found = mbs.minimise(objective, 0.7, progress=False)
    assert found.ok
    np.testing.assert_allclose(found.design, 1.0 - 0.5 * lifted, rtol=1e-6)
    np.testing.assert_allclose(found.value, lifted - 0.25 * lifted**2, rtol=1e-9)


def test_correlation_and_what_is_refused():
    pair = {"a": Normal(0.0, 1.0), "b": Normal(0.0, 2.0)}
    correlated = RandomVariables(pair, {("a", "b"): 0.5})
    np.testing.assert_allclose(
        moments(lambda x: x["a"] + x["b"], correlated, 1)[1], np.sqrt(1.0 + 4.0 + 2.0), rtol=1e-12
    )
    with pytest.raises(mbs.ModelError, match="percent must lie"):
        Robust(lambda d, x: d, pair, percent=100.0)
    with pytest.raises(TypeError, match="Robust takes a function"):
        Robust(1.0, pair)
