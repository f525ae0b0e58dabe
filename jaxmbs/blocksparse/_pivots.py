"""Elimination of the pivots of dense fronts `[F11 F12; F21 F22]`: Cholesky, block LDL^T, LU; batched over fronts.

`eliminate` returns what it keeps and what it passes on, F22 - F21 F11^-1 F12; symmetric kinds take no F21.

Each kind keeps what two matrix products per front need later.  Small pivots are inverted by whole batches in plain
XLA and kept so; the factors of large ones are LAPACK's, one front at a time (`math.lapack` says why).
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array, lax

from ..math._square import inverse_with_determinant
from ..runtime import lapack, tuning


def _T(x):
    return jnp.swapaxes(x, -1, -2)


class CholeskyPivots(NamedTuple):
    """Pivots of symmetric positive definite matrices: F11 = L L^T, W = L^-1 F12; small `L` hold the inverse L^-1."""

    L: Array
    W: Array

    @classmethod
    def eliminate(cls, F11, F12, F22):
        if F11.shape[-1] <= tuning.INVERTED_PIVOTS:
            L = _inverse_factor(F11)
            W = L @ F12
        else:
            L = jax.vmap(lapack.cholesky)(F11)
            W = _lower_solve(L, F12)
        return cls(L, W), F22 - _T(W) @ W

    def forward(self, y1, y2):
        z = self.L @ y1 if self.L.shape[-1] <= tuning.INVERTED_PIVOTS else _lower_solve(self.L, y1)
        return z, y2 - _T(self.W) @ z

    def backward(self, z, x2):
        t = z - self.W @ x2
        is_inverted = self.L.shape[-1] <= tuning.INVERTED_PIVOTS
        return _T(self.L) @ t if is_inverted else _lower_solve(self.L, t, transposed=True)

    @property
    def T(self):
        return self

    def log_determinant(self):
        """Sign and logarithm of the determinant of the pivots."""
        logs = 2.0 * jnp.sum(jnp.log(jnp.diagonal(self.L, axis1=-2, axis2=-1)), axis=-1)
        return jnp.ones_like(logs), -logs if self.L.shape[-1] <= tuning.INVERTED_PIVOTS else logs

    def negatives(self):
        return jnp.zeros(self.L.shape[:-2], int)


class LdlPivots(NamedTuple):
    """Pivots of symmetric matrices, indefinite or complex: block LDL^T with D = F11; P = F11^-1, W = P F12."""

    P: Array
    W: Array
    sign: Array
    log: Array

    @classmethod
    def eliminate(cls, F11, F12, F22):
        P, sign, log = jax.vmap(inverse_with_determinant)(F11)
        W = _apply_refined_inverse(P, F11, F12)
        return cls(0.5 * (P + _T(P)), W, sign, log), F22 - _T(F12) @ W

    def forward(self, y1, y2):
        return self.P @ y1, y2 - _T(self.W) @ y1

    def backward(self, z, x2):
        return z - self.W @ x2

    @property
    def T(self):
        return self

    def log_determinant(self):
        return self.sign, self.log

    def negatives(self):
        """Number of negative eigenvalues of the pivots: those of F11 and of its inverse have the same signs."""
        return jnp.sum(_over_fronts(lapack.eigvalsh, self.P) < 0, axis=-1)


class LuPivots(NamedTuple):
    """Pivots of any matrix on a symmetric pattern, with pivoting inside fronts: P = F11^-1, W = P F12, V = F21 P."""

    P: Array
    W: Array
    V: Array
    sign: Array
    log: Array

    @classmethod
    def eliminate(cls, F11, F12, F21, F22):
        P, sign, log = jax.vmap(inverse_with_determinant)(F11)
        W = _apply_refined_inverse(P, F11, F12)
        return cls(P, W, F21 @ P, sign, log), F22 - F21 @ W

    def forward(self, y1, y2):
        return self.P @ y1, y2 - self.V @ y1

    def backward(self, z, x2):
        return z - self.W @ x2

    @property
    def T(self):
        return LuPivots(_T(self.P), _T(self.V), _T(self.W), self.sign, self.log)

    def log_determinant(self):
        return self.sign, self.log

    def negatives(self):
        raise ValueError("the inertia of a matrix needs its symmetric factorisation: factor(matrix, 'ldl')")


KINDS: dict[str, Any] = {"cholesky": CholeskyPivots, "ldl": LdlPivots, "lu": LuPivots}


def _over_fronts(function, *stacks):
    """Map a function of single matrices over stacks (..., n, m) of them."""
    for _ in stacks[0].shape[:-2]:
        function = jax.vmap(function)
    return function(*stacks)


def _lower_solve(L, B, transposed=False):
    return _over_fronts(lambda L, B: lapack.solve_triangular(L, B, transposed=transposed), L, B)


def _apply_refined_inverse(P, F, B):
    """Product `F^-1 B` by the inverse P with one step of refinement: as accurate as by factors."""
    W = P @ B
    return W + P @ (B - F @ W)


@jax.custom_jvp
def _inverse_factor(F):
    """Inverse factor `L^-1` (..., n, n) of F = L L^T by recursive halves, whose products are faster than columns."""
    n, half = F.shape[-1], F.shape[-1] // 2
    if n <= tuning.FRONT_COLUMNS:
        return _over_fronts(_inverse_factor_by_columns, F) if n else F
    A = _inverse_factor(F[..., :half, :half])
    W = A @ F[..., :half, half:]
    D = _inverse_factor(F[..., half:, half:] - _T(W) @ W)
    upper = jnp.concatenate([A, jnp.zeros_like(W)], axis=-1)
    return jnp.concatenate([upper, jnp.concatenate([-(D @ _T(W)) @ A, D], axis=-1)], axis=-2)


@_inverse_factor.defjvp
def _inverse_factor_jvp(primals, tangents):
    """Derivative `d(L^-1) = -half(L^-1 dF L^-T) L^-1`; half: lower triangle, half the diagonal (Murray 2016)."""
    R = _inverse_factor(*primals)
    return R, -(_over_fronts(lapack.lower_half, R @ tangents[0] @ _T(R)) @ R)


def _inverse_factor_by_columns(F):
    """Inverse factor by forward elimination of `[F 1]` in one array: right of column k it holds F, else L^-1."""
    n = F.shape[0]
    index = jnp.arange(n)

    def eliminate(k, carry):
        A, pivots = carry
        row, here, below = A[k], index == k, (index > k)[:, None]
        share = jnp.where(below, (A[:, k] / row[k])[:, None], 0.0)
        A = jnp.where(below & here[None], 0.0, A) - share * jnp.where(here, 1.0, row)[None]
        return A, jnp.where(here, row[k], pivots)

    A, pivots = lax.fori_loop(0, n, eliminate, (F, jnp.ones_like(F[0])))
    return lax.rsqrt(pivots)[:, None] * (jnp.tril(A, -1) + jnp.eye(n, dtype=F.dtype))
