"""Percentiles in closed form, their derivatives, and limits of a design with a probability."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import ndtri

import jaxmbs as mbs
from jaxmbs.design import percentile
from jaxmbs.probability import LogNormal, Normal


def of_product(mean, cov, percent):
    """Closed form of the product of two lognormal numbers, of which the second has a mean of 2 and a cov of 0.1."""
    squares = jnp.log1p(jnp.stack([jnp.asarray(cov), jnp.asarray(0.1)]) ** 2)
    return 2.0 * mean * jnp.exp(-0.5 * jnp.sum(squares) + ndtri(percent / 100.0) * jnp.sqrt(jnp.sum(squares)))


@pytest.mark.slow
def test_a_product_of_lognormal_numbers():
    """On both sides of the median, with derivatives by mean and deviation."""

    def found(mean, cov, percent):
        return percentile(
            lambda x: x["a"] * x["b"], {"a": LogNormal(mean, cov * mean), "b": LogNormal(2.0, 0.2)}, percent
        )

    for percent in (2.0, 99.0):
        by = mbs.jit(jax.value_and_grad(lambda x, p=percent: found(x[0], x[1], p)), compile="tape")
        value, slopes = by(jnp.array([3.0, 0.2]))
        np.testing.assert_allclose(value, of_product(3.0, 0.2, percent), rtol=1e-9)
        wanted = jax.grad(lambda x, p=percent: of_product(x[0], x[1], p))(jnp.array([3.0, 0.2]))
        np.testing.assert_allclose(slopes, wanted, rtol=1e-6)


@pytest.mark.slow
def test_a_limit_with_a_probability():
    """The lightest rod whose stress passes the strength in one case of a thousand; a million samples confirm it."""

    def margin(design):
        numbers = {"load": LogNormal(50.0, 5.0), "strength": Normal(400.0, 20.0)}
        return percentile(lambda x: x["strength"] - x["load"] / design["area"], numbers, 0.1)

    found = mbs.minimise(
        lambda d: d["area"], {"area": 0.25}, {"area": (0.05, 1.0)}, limits=mbs.Limit("margin", margin, lower=0.0),
        progress=False,
    )  # fmt: skip
    assert found.ok
    rng = np.random.default_rng(0)
    spread = np.sqrt(np.log1p(0.01))
    load = 50.0 * np.exp(-0.5 * spread**2 + spread * rng.normal(size=1_000_000))
    fails = np.mean(400.0 + 20.0 * rng.normal(size=1_000_000) < load / found.design["area"])
    np.testing.assert_allclose(fails, 1e-3, rtol=0.1)


def test_what_is_no_percentile_is_refused():
    for percent in (0.0, 100.0, -1.0):
        with pytest.raises(mbs.ModelError, match="percent must"):
            percentile(lambda x: x["a"], {"a": Normal(0.0, 1.0)}, percent)


@pytest.mark.slow
def test_percentiles_without_a_slope_at_the_medians_and_of_several_worst_points():
    """Of a square, two sided: by its own way to other starts.  Of a ridge the first end is the wrong one."""
    numbers, d = {"a": Normal(0.0, 1.0), "b": Normal(0.0, 1.0)}, ndtri(0.99)
    square = lambda s: percentile(lambda x: s * x["a"] ** 2, numbers, 99.0)
    found = mbs.jit(jax.value_and_grad(square), compile="tape")
    np.testing.assert_allclose(found(2.0), [2.0 * d**2, d**2], rtol=1e-6)
    ridge = lambda x: 0.1 * x["a"] + 0.5 * x["b"] ** 2  # at the distance d most where a is 0.1
    np.testing.assert_allclose(percentile(ridge, numbers, 99.0), 0.1 * d, rtol=1e-6)
    np.testing.assert_allclose(percentile(ridge, numbers, 99.0, starts=8), 0.005 + 0.5 * d**2, rtol=1e-6)
    with pytest.raises(mbs.ModelError, match="starts must"):
        percentile(ridge, numbers, 99.0, starts=0)
