"""Probabilities of correlated normal numbers against closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import multivariate_normal

from jaxmbs.probability._normal_integrals import all_below, any_above

pytestmark = pytest.mark.long


def pair(rho):
    return jnp.array([[1.0, rho], [rho, 1.0]])


@pytest.mark.parametrize("rho", [-0.9, 0.0, 0.3, 0.95])
def test_two_numbers(rho):
    """At the origin the closed form 1/4 + asin(rho) / 2 pi, elsewhere SciPy's integral; small ones."""
    np.testing.assert_allclose(all_below(jnp.zeros(2), pair(rho)), 0.25 + np.arcsin(rho) / (2.0 * np.pi), rtol=1e-9)
    known = multivariate_normal([0.0, 0.0], pair(rho)).cdf([0.4, -0.7])
    np.testing.assert_allclose(all_below(jnp.array([0.4, -0.7]), pair(rho)), known, atol=1e-9)
    both = all_below(-jnp.array([3.0, 4.0]), pair(rho))
    np.testing.assert_allclose(any_above(jnp.array([3.0, 4.0]), pair(rho)), ndtr(-3.0) + ndtr(-4.0) - both, rtol=1e-9)


def test_numbers_that_are_one_or_opposite():
    np.testing.assert_allclose(any_above(jnp.array([3.0, 4.0]), pair(1.0)), ndtr(-3.0), rtol=1e-6)
    np.testing.assert_allclose(any_above(jnp.array([3.0, 4.0]), pair(-1.0)), ndtr(-3.0) + ndtr(-4.0), rtol=1e-6)


@pytest.mark.parametrize(("rho", "at_most"), [(1.0, 1e-7), (1.0 + 2e-16, 1e-7), (0.999, 5e-6)])
def test_numbers_that_are_nearly_one(rho, at_most):
    """One number above the lesser of two limits, or between two: a step within the range of the rule."""
    low, high = ndtr(-0.5), ndtr(0.7)
    if rho >= 1.0:
        np.testing.assert_allclose(any_above(jnp.array([3.0, 2.5]), pair(rho)), ndtr(-2.5), rtol=2e-6)
        np.testing.assert_allclose(any_above(jnp.array([-0.5, -0.7]), pair(rho)), ndtr(0.7), rtol=2e-6)
        np.testing.assert_allclose(all_below(jnp.array([0.5, 0.7]), pair(-rho)), ndtr(0.5) - ndtr(-0.7), rtol=1e-8)
        np.testing.assert_allclose(any_above(jnp.array([-0.5, -0.7]), pair(-rho)), 1.0, rtol=1e-8)
    np.testing.assert_allclose(all_below(jnp.array([2.0, -4.0]), pair(rho)), ndtr(-4.0), rtol=at_most)
    np.testing.assert_allclose(all_below(jnp.array([-0.5, 0.7]), pair(rho)), min(low, high), rtol=at_most)


def test_many_numbers_of_one_cause():
    """Equally correlated: one integral over the common cause (Dunnett and Sobel 1955)."""
    m, rho, limit = 5, 0.6, 3.2
    z, weights = np.polynomial.hermite_e.hermegauss(150)
    below = ndtr((limit - np.sqrt(rho) * z) / np.sqrt(1.0 - rho)) ** m
    R = jnp.full((m, m), rho) + (1.0 - rho) * jnp.eye(m)
    any_of = weights @ (1.0 - below) / np.sqrt(2.0 * np.pi)
    np.testing.assert_allclose(any_above(jnp.full(m, limit), R), any_of, rtol=1e-3)
    all_of = weights @ ndtr((-limit - np.sqrt(rho) * z) / np.sqrt(1.0 - rho)) ** m / np.sqrt(2.0 * np.pi)
    np.testing.assert_allclose(all_below(jnp.full(m, -limit), R), all_of, rtol=1e-3)


def test_derivatives_by_limits_and_correlation():
    """By a limit the density there times the rest; by the correlation the density of both (Plackett 1954)."""
    slopes = jax.grad(lambda x: all_below(x[:2], pair(x[2])))(jnp.array([0.4, -0.7, 0.3]))
    density = np.exp(-0.5 * 0.4**2) / np.sqrt(2.0 * np.pi)
    np.testing.assert_allclose(slopes[0], density * ndtr((-0.7 - 0.3 * 0.4) / np.sqrt(1 - 0.09)), rtol=1e-8)
    both = multivariate_normal([0.0, 0.0], pair(0.3)).pdf([0.4, -0.7])
    np.testing.assert_allclose(slopes[2], both, rtol=1e-8)
