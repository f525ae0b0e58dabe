"""The mark of what has no forward derivative."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.runtime._reverse_only import reverse_only


def cube(x, y=2.0):
    marked = reverse_only({"x": x, "name": "cube", "y": jnp.asarray(y)}, "take the other mode")
    return jnp.sum(marked["x"] ** 3) * marked["y"]


X = jnp.array([1.0, -2.0])


@pytest.mark.parametrize("wrap", [pytest.param(lambda f: f, marks=pytest.mark.long), jax.jit], ids=["eager", "jit"])
def test_reverse_passes_and_forward_is_told(wrap):
    np.testing.assert_array_equal(wrap(cube)(X), 2.0 * jnp.sum(X**3))
    np.testing.assert_array_equal(wrap(jax.grad(cube))(X), 6.0 * X**2)
    np.testing.assert_array_equal(wrap(jax.jacrev(jax.vmap(cube)))(X[None]), [[6.0 * X**2]])
    np.testing.assert_array_equal(wrap(jax.vmap(jax.grad(cube)))(X[None]), [6.0 * X**2])
    np.testing.assert_array_equal(wrap(jax.jacfwd(jax.grad(cube)))(X), jnp.diag(12.0 * X))
    np.testing.assert_array_equal(wrap(jax.jacrev(jax.grad(cube)))(X), jnp.diag(12.0 * X))
    np.testing.assert_array_equal(wrap(jax.jacfwd(lambda t: t * cube(X)))(1.0), cube(X))
    for forward in (jax.jacfwd(cube), jax.jacfwd(jax.vmap(cube)), lambda x: jax.jvp(cube, (x,), (x,))[1]):
        with pytest.raises(TypeError, match="take the other mode"):
            wrap(forward)(X[None])


def test_the_mark_costs_nothing():
    """No equation of the compiled program, and no tangent of what does not move."""
    assert "reverse_only" in str(jax.make_jaxpr(cube)(X))
    assert "reverse_only" not in jax.jit(cube).lower(X).as_text()
    assert "reverse_only" not in jax.jit(jax.grad(cube)).lower(X).as_text()
