import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.math._extremes import largest, least


@pytest.mark.parametrize("axis", [None, 0, 1])
def test_numpy_agrees(axis):
    x = np.random.default_rng(2).normal(size=(5, 4))
    np.testing.assert_array_equal(largest(jnp.asarray(x), axis), np.max(x, axis))
    np.testing.assert_array_equal(least(jnp.asarray(x), axis), np.min(x, axis))


@pytest.mark.parametrize("find, place", [(largest, 2), (least, 1)])
def test_derivatives_are_those_of_the_number_found(find, place):
    x = jnp.array([1.0, -2.0, 3.0, 3.0])
    np.testing.assert_array_equal(jax.grad(find)(x), np.eye(4)[place])
    np.testing.assert_array_equal(jax.jacfwd(find)(x), np.eye(4)[place])


def test_nan_is_not_passed_over():
    x = jnp.array([1.0, jnp.nan, 2.0])
    assert np.isnan(largest(x)) and np.isnan(least(x))
