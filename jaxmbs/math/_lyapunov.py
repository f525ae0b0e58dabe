"""Lyapunov equations by the matrix sign function: it needs no eigenvectors, so that poles may repeat."""

import jax.numpy as jnp
from jax import lax

from . import _square as square

#: Steps of Newton's iteration at most: it halves the logarithm of the condition, then squares the error.
STEPS = 100


def lyapunov(A, Q):
    """Solution X (n, n) of `A X + X A^T + Q = 0` for a stable A; derivatives of every order.

    NaN where A is not stable.  Source: Roberts (1980).
    """
    fixed = lax.stop_gradient(A)
    return lax.custom_linear_solve(
        lambda X: -(A @ X + X @ A.T), Q, lambda _, Q: _solve(fixed, Q), lambda _, Q: _solve(fixed.T, Q)
    )


def _solve(A, Q):
    first = _sign_iteration(A, Q)
    return first + _sign_iteration(A, Q + A @ first + first @ A.T)


def _sign_iteration(A, Q):
    """Newton's iteration of the sign of `[A Q; 0 -A^T]`, scaled by norms until it converges."""
    n, eps = len(A), jnp.finfo(A.dtype).eps
    eye = jnp.eye(n, dtype=A.dtype)

    def step(carry):
        A, Q, _, count = carry
        inverse = square.solve(A, eye)
        c = jnp.sqrt(jnp.linalg.norm(A) / jnp.linalg.norm(inverse))
        near = jnp.linalg.norm(A + eye) < 0.1
        c = jnp.where(near, 1.0, c)
        new = (A / c + c * inverse) / 2
        return new, (Q / c + c * (inverse @ Q @ inverse.T)) / 2, jnp.linalg.norm(new - A), count + 1

    def goes_on(carry):
        _, _, change, count = carry
        return (change > 16 * eps * n) & (count < STEPS)

    first = A, Q, jnp.asarray(jnp.inf, A.dtype), 0
    A, Q, _, count = lax.while_loop(goes_on, step, first)
    stable = jnp.linalg.norm(A + eye) < eps**0.25
    return jnp.where(stable, Q / 2, jnp.nan)
