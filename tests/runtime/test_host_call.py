"""Functions that the host evaluates: values, slopes in both modes, and what is refused."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.runtime import host_call, one_kernel


def values(z):
    return np.array([z[0] * z[1], np.sin(z[1])])


def slopes(z):
    return np.array([[z[1], z[0]], [0.0, np.cos(z[1])]])


def refuse(what):
    return ValueError(f"no {what} here")


def test_values_and_slopes_are_those_of_the_host():
    f, z = host_call(values, slopes, 2, refuse), jnp.array([2.0, 0.5])
    np.testing.assert_allclose(jax.jit(f)(z), values(np.asarray(z)))
    np.testing.assert_allclose(jax.jacfwd(f)(z), slopes(np.asarray(z)))
    np.testing.assert_allclose(jax.jacrev(f)(z), slopes(np.asarray(z)))


def test_one_vmap_is_a_row_after_the_other_and_a_second_is_refused():
    f, z = host_call(values, slopes, 2, refuse), jnp.array([[2.0, 0.5], [3.0, -1.0]])
    np.testing.assert_allclose(jax.vmap(f)(z), [values(row) for row in np.asarray(z)])
    with pytest.raises(ValueError, match="no batch here"):
        jax.vmap(jax.vmap(f))(z[None])
    with pytest.raises(ValueError, match="no second derivative here"):
        jax.hessian(lambda z: f(z)[0])(z[0])
    with pytest.raises(ValueError, match="no derivative here"):
        jax.grad(lambda z: host_call(values, None, 2, refuse)(z)[0])(z[0])


def test_a_function_as_one_kernel_is_the_same_function():
    z = jnp.array([2.0, 0.5, -1.0])
    f = lambda z: jnp.concatenate([jnp.sin(z), z[:1] * z[1]])
    np.testing.assert_allclose(jax.jit(one_kernel(f, marks=False))(z), f(z), rtol=1e-15)
