"""Greatest and least numbers of arrays, whose derivatives do not depend on how a compiler rounds."""

import jax.numpy as jnp
from jax import Array, lax


def largest(x: Array, axis: int | None = None) -> Array:
    """The largest number along an axis, or of all: the first of equals, NaN where there is one.

    JAX's own derivative of `jnp.max` looks for the numbers that equal the largest.  A program may calculate them
    twice, in two pieces that round apart: none equals it then, and the derivative is NaN.
    """
    if axis is None:
        x, axis = jnp.ravel(x), 0
    place = jnp.argmax(lax.stop_gradient(x), axis=axis, keepdims=True)
    return jnp.squeeze(jnp.take_along_axis(x, place, axis=axis), axis)


def least(x: Array, axis: int | None = None) -> Array:
    """The least number along an axis, or of all, as `largest`."""
    return -largest(-x, axis)
