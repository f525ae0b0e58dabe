"""The exponential of a matrix, in plain XLA."""

import jax.numpy as jnp
import numpy as np
from jax import lax

from ._square import solve

#: Coefficients of the diagonal approximation of Pade of order 13, the first one 1.
_PADE = np.cumprod([1.0, *[(14 - k) / (k * (27 - k)) for k in range(1, 14)]])
#: Norms up to which it is right to rounding.  Source: N. Higham, SIAM J. Matrix Anal. Appl. 26 (2005) 1179.
_REACH = 5.37
_MOST_SQUARINGS = 16  # norms up to 3e5; beyond, the exponential of a motion has no digits left


def expm(A):
    """`e^A` (n, n) by scaling and squaring; derivatives of every order.  NaN where |A|_1 is beyond 3.5e5."""
    size = lax.stop_gradient(jnp.max(jnp.sum(jnp.abs(A), axis=0)))
    halvings = jnp.maximum(0.0, jnp.ceil(jnp.log2(jnp.maximum(size, 1e-30) / _REACH)))
    A = A * jnp.exp2(-jnp.where(halvings > _MOST_SQUARINGS, jnp.nan, halvings))
    square, power = A @ A, jnp.eye(A.shape[0], dtype=A.dtype)
    even, odd = jnp.zeros_like(A), jnp.zeros_like(A)
    for c_even, c_odd in _PADE.reshape(7, 2).tolist():
        even, odd, power = even + c_even * power, odd + c_odd * power, power @ square
    odd = A @ odd
    found = solve(even - odd, even + odd)
    return lax.fori_loop(0, _MOST_SQUARINGS, lambda k, X: jnp.where(k < halvings, X @ X, X), found)
