"""NaN for what is lost: its derivative is NaN where it is used, and harms nothing where it is not."""

import jax
import jax.numpy as jnp
from jax import Array, lax

from ..typing import ArrayLike


def nan_where(lost: Array, x: Array) -> Array:
    """x (n, ...) or (), NaN where `lost` (n,) or () holds; derivatives as in `value_where`."""
    return value_where(lost, x, jnp.full_like(x, jnp.nan))


@jax.custom_jvp
def nan_slope_where(lost: Array, x: Array) -> Array:
    """x itself, with the derivatives of `value_where`: without them `lost` is not computed."""
    del lost
    return x


@nan_slope_where.defjvp
def _nan_slope_where_jvp(primals, tangents):
    lost, x = primals
    return jax.jvp(lambda x: value_where(lost, x, lax.stop_gradient(x)), (x,), (tangents[1],))


@jax.custom_jvp
def value_where(lost: Array, x: Array, value: Array) -> Array:
    """x (n, ...) or (), `value` where `lost` (n,) or () holds, with derivatives by x alone.

    A tangent there is NaN.  A cotangent that is zero there stays zero, as the value is not used; any other is NaN,
    not the zero of a branch that was not taken, which a search would believe.
    """
    return jnp.where(_expand_to(lost, x), value, x)


@value_where.defjvp
def _value_where_jvp(primals, tangents):
    lost, x, _ = primals
    factor = jnp.where(_expand_to(lost, x), jnp.asarray(jnp.nan, x.dtype), 1.0)

    def times(_, right):
        return right * factor

    def used(_, bar):
        return jnp.where(bar == 0.0, 0.0, bar * factor)

    # a linear solve, as that may have a transpose of its own
    return value_where(*primals), lax.custom_linear_solve(lambda x: x / factor, tangents[1], times, used)


def _expand_to(lost, x):
    """`lost` with as many axes as x."""
    return jnp.reshape(lost, jnp.shape(lost) + (1,) * (x.ndim - jnp.ndim(lost)))


def masked(mask: Array, x: Array, value: ArrayLike) -> Array:
    """x with the entries of its first axis where `mask` holds replaced by `value`."""
    mask = mask.reshape(mask.shape + (1,) * (x.ndim - 1))
    return jnp.where(mask, jnp.broadcast_to(jnp.asarray(value, x.dtype), x.shape), x)
