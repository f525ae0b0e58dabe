"""Loops over products of large matrices, which XLA's CPU compiler is not to make one kernel of."""

import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array

from ._tricks import is_on


def with_library_calls(x: Array) -> Array:
    """x (n,), n > 1, finite, inside the body of a loop, whose products of matrices then stay calls of XLA's library.

    With XLA_FLAGS for small loops, or on JAX 0.12, XLA makes one kernel of a loop, in which a product is three plain
    loops: of large matrices twenty times as slow.  No kernel holds a sort, so that of two numbers keeps XLA from it.
    """
    if not is_on("library_calls") or jax.default_backend() != "cpu":
        return x
    first, second = lax.sort(lax.stop_gradient(x[:2]))
    return jnp.where(first > second, jnp.nan, x)  # never, but XLA does not know that
