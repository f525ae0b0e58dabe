"""NaN for what is lost: its derivative is NaN where it is used, and harms nothing where it is not."""

import jax
import jax.numpy as jnp
from jax import Array, lax


@jax.custom_jvp
def nan_where(lost: Array, x: Array) -> Array:
    """x (n, ...) or (), NaN where `lost` (n,) or () holds.

    A tangent there is NaN.  A cotangent that is zero there stays zero, as the value is not used; any other is NaN,
    not the zero of a branch that was not taken, which a search would believe.
    """
    return jnp.where(_beside(lost, x), jnp.asarray(jnp.nan, x.dtype), x)


@jax.custom_jvp
def nan_slope_where(lost: Array, x: Array) -> Array:
    """x itself, with the derivatives of `nan_where`."""
    del lost
    return x


@nan_where.defjvp
def _nan_where_jvp(primals, tangents):
    return nan_where(*primals), _nan_tangent(*primals, tangents[1])


@nan_slope_where.defjvp
def _nan_slope_where_jvp(primals, tangents):
    return nan_slope_where(*primals), _nan_tangent(*primals, tangents[1])


def _nan_tangent(lost, x, tangent):
    """The tangent times NaN where lost; a linear solve, as that may have a transpose of its own."""
    factor = jnp.where(_beside(lost, x), jnp.asarray(jnp.nan, x.dtype), 1.0)

    def times(_, right):
        return right * factor

    def used(_, bar):
        return jnp.where(bar == 0.0, 0.0, bar * factor)

    return lax.custom_linear_solve(lambda x: x / factor, tangent, times, used)


def _beside(lost, x):
    """`lost` with as many axes as x."""
    return jnp.reshape(lost, jnp.shape(lost) + (1,) * (x.ndim - jnp.ndim(lost)))
