"""Piecewise cubic interpolation against SciPy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.interpolate

from jaxmbs.math._interpolation import hermite, hermite_integral, interval, pchip_slopes
from tests.marks import cases

CURVES = {
    "rising": ([0.0, 0.5, 2.0, 2.2, 4.0], [0.0, 1.0, 1.5, 4.0, 4.5]),
    "turning": ([-1.0, 0.0, 1.0, 3.0], [1.0, -2.0, 5.0, 4.9]),
    "flat": ([-1.0, 0.0, 1.0, 3.0], [0.0, 0.0, 0.0, 1.0]),
    "steep_ends": ([0.0, 1.0, 1.1, 4.0], [0.0, 0.1, 3.0, 2.9]),
    "three": ([0.0, 1.0, 3.0], [1.0, 0.0, 5.0]),
    "two": ([0.0, 2.0], [1.0, 5.0]),
}
parametrise = pytest.mark.parametrize("points, values", CURVES.values(), ids=CURVES)


@pytest.mark.parametrize("name", cases(CURVES, long=["rising", "turning", "flat"]))
def test_pchip_is_scipys(name):
    points, values = CURVES[name]
    oracle, x = scipy.interpolate.PchipInterpolator(points, values), np.linspace(points[0], points[-1], 61)
    points, values = jnp.array(points), jnp.array(values)
    slopes = pchip_slopes(points, values)
    np.testing.assert_allclose(slopes, oracle(np.asarray(points), 1), atol=1e-13)
    ours = jax.vmap(lambda x: hermite(points, values, slopes, x))(jnp.asarray(x))
    np.testing.assert_allclose(ours, oracle(x), atol=1e-12)
    areas = jax.vmap(lambda x: hermite_integral(points, values, slopes, x))(jnp.asarray(x))
    np.testing.assert_allclose(areas, oracle.antiderivative()(x), atol=1e-12)


@pytest.mark.parametrize("name", cases(CURVES, long=["rising"], rest=pytest.mark.slow))
def test_continuation_is_a_line_and_the_integral_its_own(name):
    points, values = CURVES[name]
    points, values = jnp.array(points), jnp.array(values)
    slopes = pchip_slopes(points, values)
    for end, x in ((0, points[0] - 1.5), (-1, points[-1] + 1.5)):
        line = values[end] + slopes[end] * (x - points[end])
        np.testing.assert_allclose(hermite(points, values, slopes, x), line, rtol=1e-13)
    for x in (points[0] - 0.7, points[0], points[1], 0.6 * points[0] + 0.4 * points[1], points[-1] + 0.7):
        slope = jax.grad(hermite_integral, argnums=3)(points, values, slopes, x)
        np.testing.assert_allclose(slope, hermite(points, values, slopes, x), rtol=1e-12, atol=1e-12)
        rate = jax.grad(hermite, argnums=3)(points, values, slopes, x)
        ends = [hermite(points, values, slopes, x + h) for h in (1e-6, -1e-6)]
        np.testing.assert_allclose(rate, (ends[0] - ends[1]) / 2e-6, atol=1e-3)


@parametrise
def test_derivatives_in_the_data_are_finite(points, values):
    def total(points, values):
        xs = jnp.linspace(-2.0, 5.0, 23)
        return jax.vmap(lambda x: hermite_integral(points, values, pchip_slopes(points, values), x))(xs).sum()

    slopes = jax.jit(jax.grad(total, argnums=(0, 1)))(jnp.array(points), jnp.array(values))
    assert all(np.isfinite(slope).all() for slope in slopes)


def test_interval():
    found = [int(interval(jnp.array([0.0, 1.0, 2.0]), jnp.array(x))) for x in (-1.0, 0.0, 0.5, 1.0, 2.0, 3.0)]
    assert found == [0, 0, 0, 1, 1, 1]


@pytest.mark.parametrize("n", [2, 64, 65, 81, 2010])
def test_intervals_of_short_and_long_tables(n):
    """Between, at and beside the points, and beyond the ends."""
    draws = np.random.default_rng(n)
    points = np.cumsum(draws.uniform(0.1, 1.0, n))
    x = np.concatenate([points, points + 1e-9, points - 1e-9, [-5.0, 1e9], draws.uniform(points[0], points[-1], 100)])
    found = jax.vmap(lambda x: interval(jnp.asarray(points), x))(jnp.asarray(x))
    np.testing.assert_array_equal(found, np.clip(np.searchsorted(points, x, side="right") - 1, 0, n - 2))
