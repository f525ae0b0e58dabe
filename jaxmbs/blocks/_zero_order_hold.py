"""Discrete forms of linear blocks whose input is held over a period, as those of `scipy.signal.cont2discrete`."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..math._exponential import expm
from ..typing import ArrayLike


def zero_order_hold(A: Array, B: Array, period: Array) -> tuple[Array, Array]:
    """`x(t + period) = F x(t) + G u` of `dx/dt = A x + B u`, by one exponential of both matrices."""
    n, k = B.shape
    rows = jnp.concatenate([A, B], axis=1)
    found = expm(period * jnp.concatenate([rows, jnp.zeros((k, n + k), rows.dtype)]))
    return found[:n, :n], found[:n, n:]


def canonical_matrices(denominator: Float[Array, " n"]) -> tuple[Array, Array]:
    """A (n, n) and B (n, 1) of the controllable canonical form, of the coefficients below the highest, which is one,
    lowest power first."""
    n, dtype = denominator.shape[0], denominator.dtype
    return jnp.eye(n, k=1, dtype=dtype).at[-1].add(-denominator), jnp.zeros((n, 1), dtype).at[-1].set(1.0)


def lag_share(span: ArrayLike) -> Array:
    """Part of its way that a lag goes in a time of so many time constants, `1 - exp(-span)`."""
    return -jnp.expm1(-jnp.asarray(span))
