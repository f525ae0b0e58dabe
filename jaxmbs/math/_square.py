"""Square systems of any kind: small ones by Gauss-Jordan elimination in plain XLA, large ones by LAPACK's LU."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..runtime import is_on, jit, lapack, tuning


@jit
def solve(A, B):
    """`A^-1 B` for A (n, n) and B (n,) or (n, k), real or complex; derivatives of every order.

    Non-finite where A is singular.
    """
    dtype = np.promote_types(A.dtype, B.dtype)
    return solver(A.astype(dtype))(B.astype(dtype))


def solver(A):
    """The function B -> `A^-1 B`, as `solve`, of one factor for every right side of A's type."""
    factor = factorise(lax.stop_gradient(A))
    straight, turned = ((lambda _, B, t=t: factor.solve(B, t)) for t in (False, True))

    def solve_with(B):
        X = B[:, None] if B.ndim == 1 else B
        return lax.custom_linear_solve(lambda X: A @ X, X, straight, turned).reshape(B.shape)

    return solve_with


def inverse(A):
    """`A^-1` (n, n); derivatives of every order."""
    return inverse_with_determinant(A)[0]


class Inverted(NamedTuple):
    """A small matrix and its inverse: solutions are refined against the matrix."""

    matrix: Array
    inverse: Array

    def solve(self, B, transposed=False):
        """`A^-1 B`, or `A^-T B`, for B (n, k)."""
        A, P = (x.T if transposed else x for x in self)
        X = P @ B
        for _ in range(1 if self.matrix.real.dtype.itemsize == 8 else 2):
            X = X + P @ (B - A @ X)
        return X


class Lu(NamedTuple):
    """LAPACK's factors in one matrix, and the permutation of the rows."""

    factors: Array
    permutation: Array

    def solve(self, B, transposed=False):
        """`A^-1 B`, or `A^-T B`, for B (n, k)."""
        factors = self.factors
        if transposed:
            X = lapack.solve_factor(factors, B, lower=False, transposed=True)
            X = lapack.solve_factor(factors, X, transposed=True, unit=True)
            return jnp.zeros_like(X).at[self.permutation].set(X)
        X = lapack.solve_factor(factors, B[self.permutation], unit=True)
        return lapack.solve_factor(factors, X, lower=False)


def _is_eliminated(A):
    """True if A (n, n) is inverted by elimination: batches of such matrices need no loop over LAPACK calls."""
    return not A.shape[0] or (A.shape[0] <= tuning.ELIMINATED_UNKNOWNS and is_on("gauss_jordan"))


def factorise(A):
    """A factor of A (n, n) that solves with it: `Inverted` or `Lu`; no derivative in reverse mode."""
    return Inverted(A, gauss_jordan_inverse(A)[0]) if _is_eliminated(A) else Lu(*lapack.lu(A))


@jax.custom_jvp
def inverse_with_determinant(A):
    """`A^-1` (n, n), the sign (or phase) of det A, and log |det A|; the sign is a constant to differentiation."""
    if _is_eliminated(A):
        P, pivots, order = gauss_jordan_inverse(A)
    else:
        factors, order = lapack.lu(A)
        P = Lu(factors, order).solve(jnp.eye(A.shape[0], dtype=A.dtype))
        pivots = jnp.diagonal(factors)
    size = jnp.abs(pivots)
    phase = jnp.prod(pivots / jnp.where(size == 0, 1, size).astype(A.dtype))
    exchanged = jnp.sum(jnp.triu(order[:, None] > order[None])) % 2 == 1  # inversions: its parity
    return P, jnp.where(exchanged, -phase, phase), jnp.sum(jnp.log(size))


@inverse_with_determinant.defjvp
def _inverse_jvp(primals, tangents):
    P, sign, log = inverse_with_determinant(*primals)
    change = P @ tangents[0]
    return (P, sign, log), (-change @ P, jnp.zeros_like(sign), jnp.trace(change).real)


@jit
def gauss_jordan_inverse(A):
    """`A^-1` (n, n), the pivots (n,) in turn and the rows (n,) they stood in, by Gauss-Jordan elimination in place.

    The largest entry left in a column is its pivot; rows stay where they are until the end.
    """
    n = A.shape[0]
    index = jnp.arange(n)
    if n == 0:
        return A, jnp.diagonal(A), index

    def eliminate(k, carry):
        A, pivots, order, free = carry
        column = A[:, k]
        size = jnp.where(free, jnp.abs(column), -1.0)
        at = index == jnp.argmax(jnp.where(jnp.isnan(size), jnp.inf, size))
        row = jnp.sum(jnp.where(at[:, None], A, 0.0), axis=0)
        pivot, here = row[k], index == k
        share = jnp.where(at, -1.0, column) / pivot
        A = jnp.where(at[:, None] | here[None], 0.0, A) - share[:, None] * jnp.where(here, 1.0, row)[None]
        return A, jnp.where(here, pivot, pivots), jnp.where(here, jnp.argmax(at), order), free & ~at

    start = (A, jnp.ones_like(A, shape=(n,)), index, index >= 0)
    A, pivots, order, _ = lax.fori_loop(0, n, eliminate, start)
    back = index.at[order].set(index)  # no sort: that would keep a march from being one kernel
    return A[order][:, back], pivots, order
