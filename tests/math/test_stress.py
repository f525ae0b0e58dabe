"""Measures of stress: NumPy's eigenvalues, states in closed form, derivatives of equal values and at no stress."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.math._stress import principal, signed_von_mises, von_mises

RANDOM = np.random.default_rng(3).normal(size=(2, 5, 6))


def matrix(s):
    return np.array([[s[0], s[3], s[5]], [s[3], s[1], s[4]], [s[5], s[4], s[2]]])


@pytest.mark.slow
def test_values_are_those_of_the_matrix():
    values = np.array([[np.linalg.eigvalsh(matrix(s))[::-1] for s in row] for row in RANDOM])
    np.testing.assert_allclose(principal(jnp.array(RANDOM)), values, atol=1e-13)
    a, b, c = np.moveaxis(values, -1, 0)
    wanted = np.sqrt(((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2) / 2)
    np.testing.assert_allclose(von_mises(jnp.array(RANDOM)), wanted, rtol=1e-12)


def test_states_in_closed_form():
    pull, twist, press = np.eye(6)[0], np.eye(6)[3], -np.array([1.0, 1, 1, 0, 0, 0])
    states = jnp.array([2 * pull, -2 * pull, twist, press])
    np.testing.assert_allclose(von_mises(states), [2, 2, np.sqrt(3), 0], atol=1e-15)
    np.testing.assert_allclose(signed_von_mises(states), [2, -2, np.sqrt(3), 0], atol=1e-15)
    np.testing.assert_allclose(principal(states[2]), [1, 0, -1], atol=1e-15)


def test_derivatives():
    x, h = jnp.array(RANDOM[0, 0]), 1e-6
    ends = jnp.concatenate([x[None] + h * jnp.eye(6), x[None] - h * jnp.eye(6)])

    @jax.jit
    def everything(x, ends, pull):
        found = []
        for measure in (von_mises, lambda s: principal(s)[..., 0], lambda s: principal(s)[..., 2]):
            values = measure(ends)
            found.append((jax.grad(measure)(x), (values[:6] - values[6:]) / (2 * h)))
        of_equal = jax.grad(lambda s: principal(s)[0])(pull), jax.grad(lambda s: principal(s)[1])(pull)
        return found, of_equal, jax.grad(von_mises)(0.0 * pull)

    pull = jnp.eye(6)[0]  # two of its principal stresses are equal
    found, of_equal, at_none = everything(x, ends, pull)
    for slope, difference in found:
        np.testing.assert_allclose(slope, difference, rtol=1e-7, atol=1e-9)
    np.testing.assert_array_equal(at_none, 0.0)
    np.testing.assert_allclose(of_equal[0], pull, atol=1e-15)
    assert np.all(np.isfinite(of_equal[1]))
