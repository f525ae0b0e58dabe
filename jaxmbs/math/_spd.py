"""Symmetric positive definite matrices in plain XLA: the inverse by Gauss-Jordan sweeps, solutions by refinement.

No LAPACK: jaxlib before 0.11.2 runs a batched LAPACK call on the threads that wait for it, so that two of them at
once stop a process on two cores for good.  Small matrices under `vmap` are faster this way too.
"""

import jax.numpy as jnp
import numpy as np
from jax import lax

from ..runtime import is_on, lapack, tuning


def spd_inverse(H):
    """Inverse of a symmetric positive definite H (n, n) by Gauss-Jordan elimination; no derivative passes.

    NaN where a pivot is not positive.  Columns are brought to a unit diagonal first: every pivot is at most one.
    """
    H = lax.stop_gradient(H)
    unit = lax.rsqrt(jnp.sum(H * np.eye(H.shape[0], dtype=H.dtype), axis=1))
    unit = unit[:, None] * unit[None]
    if not is_on("gauss_jordan"):
        sweep = _by_lapack
    else:
        sweep = _by_columns if H.shape[0] <= tuning.SPD_COLUMNS else _by_blocks
    return sweep(H * unit) * unit if len(H) else H


def _by_lapack(H):
    """The inverse by Cholesky's factor; NaN where there is none."""
    L = lapack.cholesky(H)
    return lapack.solve_factor(L, lapack.solve_factor(L, jnp.eye(len(H), dtype=H.dtype)), transposed=True)


def _by_columns(H):
    """One rank-one update per column: with the row's pivot d as d - 1 it does row, column and rest at once and leaves
    2 - 1/d in the corner."""
    eye = np.eye(H.shape[0], dtype=H.dtype)

    def eliminate(H, step):
        k, unit = step
        row = lax.dynamic_index_in_dim(H, k, 0, keepdims=False, allow_negative_indices=False)
        pivot = jnp.dot(row, unit)
        moved = row - unit
        return H - (moved / jnp.where(pivot > 0.0, pivot, jnp.nan))[:, None] * moved[None], None

    return 2.0 * eye - lax.scan(eliminate, H, (np.arange(H.shape[0], dtype=np.int32), eye))[0]


def _by_blocks(H):
    """The same with blocks of columns for columns, D - 1 for d - 1, and D^-1 by its Cholesky factor: with the inverse
    itself what is passed on would lose the digits of D's condition."""
    n = H.shape[0]
    size = -(-n // tuning.SPD_BLOCK) * tuning.SPD_BLOCK
    eye = jnp.eye(size, dtype=H.dtype)
    padded = eye.at[:n, :n].set(H)

    def eliminate(k, H):
        rows = lax.dynamic_slice_in_dim(H, k * tuning.SPD_BLOCK, tuning.SPD_BLOCK)
        corner = lax.dynamic_slice_in_dim(rows, k * tuning.SPD_BLOCK, tuning.SPD_BLOCK, axis=1)
        moved = _divided_by_root(corner, rows - lax.dynamic_slice_in_dim(eye, k * tuning.SPD_BLOCK, tuning.SPD_BLOCK))
        return H - moved.T @ moved

    return (2.0 * eye - lax.fori_loop(0, size // tuning.SPD_BLOCK, eliminate, padded))[:n, :n]


def _divided_by_root(D, X):
    """`L^-1 X` (b, n) for D = L L^T (b, b), by forward elimination."""
    below = jnp.arange(D.shape[0])

    def eliminate(k, carry):
        D, X = carry
        factor = jnp.where(below > k, D[:, k] / D[k, k], 0.0)[:, None]
        return D - factor * D[k][None], X - factor * X[k][None]

    D, X = lax.fori_loop(0, D.shape[0], eliminate, (D, X))
    pivots = jnp.sum(D * jnp.eye(D.shape[0], dtype=D.dtype), axis=1)
    return X * jnp.where(pivots > 0.0, lax.rsqrt(pivots), jnp.nan)[:, None]


def refined(solve, apply, right, refinements):
    """Solution of `apply(x) = right` by an approximate `solve`, corrected for what is left over."""
    x = solve(right)
    for _ in range(refinements):
        x = x + solve(right - apply(x))
    return x


def spd_solve(H, right, refinements=1):
    """Solution of `H X = right` for H (n, n) symmetric positive definite, right (n,) or (n, k).

    It has derivatives of every order.
    """
    inverse, fixed = spd_inverse(H), lax.stop_gradient(H)

    def solve(_, right):
        return refined(lambda r: inverse @ r, lambda x: fixed @ x, right, refinements)

    return lax.custom_linear_solve(lambda x: H @ x, right, solve, symmetric=True)
