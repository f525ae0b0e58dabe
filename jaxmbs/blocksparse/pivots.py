"""Elimination of the pivots of dense fronts `[F11 F12; F21 F22]`: Cholesky, block LDL^T, LU; batched over fronts.

`eliminate` returns what it keeps and what it passes on, F22 - F21 F11^-1 F12; symmetric kinds take no F21.

Each kind keeps what two matrix products per front need later.  Small pivots are kept inverted: products of small
matrices are cheaper than triangular solves.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array
from jax.lax import linalg

#: Pivots of at most this many coordinates are kept as the inverse of their factor.
INVERTED = 64


def _T(x):
    return jnp.swapaxes(x, -1, -2)


def _eye_like(x):
    return jnp.broadcast_to(jnp.eye(x.shape[-1], dtype=x.dtype), x.shape)


class Cholesky(NamedTuple):
    """Of symmetric positive definite matrices: F11 = L L^T, W = L^-1 F12; `L` holds L^-1 where it is small."""

    L: Array
    W: Array

    @classmethod
    def eliminate(cls, F11, F12, F22):
        L = linalg.cholesky(_T(F11), symmetrize_input=False)  # transposed: the layout LAPACK takes without a copy
        if F11.shape[-1] <= INVERTED:
            L = _lower_inverse(L, max(8, F11.shape[-1] // 4))
            W = L @ F12
        else:
            W = _lower_solve(L, F12)
        return cls(L, W), F22 - _T(W) @ W

    def forward(self, y1, y2):
        z = self.L @ y1 if self.L.shape[-1] <= INVERTED else _lower_solve(self.L, y1)
        return z, y2 - _T(self.W) @ z

    def backward(self, z, x2):
        t = z - self.W @ x2
        return _T(self.L) @ t if self.L.shape[-1] <= INVERTED else _lower_solve(self.L, t, transposed=True)

    @property
    def T(self):
        return self

    def log_determinant(self):
        """(sign, log |det|) of the pivots."""
        logs = 2.0 * jnp.sum(jnp.log(jnp.diagonal(self.L, axis1=-2, axis2=-1)), axis=-1)
        return jnp.ones_like(logs), -logs if self.L.shape[-1] <= INVERTED else logs

    def negatives(self):
        return jnp.zeros(self.L.shape[:-2], int)


class Ldl(NamedTuple):
    """Of symmetric matrices, indefinite or complex: block LDL^T with D = F11 whole; P = F11^-1, W = P F12."""

    P: Array
    W: Array
    sign: Array
    log: Array

    @classmethod
    def eliminate(cls, F11, F12, F22):
        both, sign, log = _solve_with_determinant(F11, jnp.concatenate([F12, _eye_like(F11)], axis=-1))
        W, P = both[..., : F12.shape[-1]], both[..., F12.shape[-1] :]
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
        """Negative eigenvalues of the pivots: those of F11 and of its inverse have the same signs."""
        return jnp.sum(jnp.linalg.eigvalsh(self.P) < 0, axis=-1)


class Lu(NamedTuple):
    """Of any matrix on a symmetric pattern, pivoting inside fronts: P = F11^-1, W = P F12, V = F21 P."""

    P: Array
    W: Array
    V: Array
    sign: Array
    log: Array

    @classmethod
    def eliminate(cls, F11, F12, F21, F22):
        both, sign, log = _solve_with_determinant(F11, jnp.concatenate([F12, _eye_like(F11)], axis=-1))
        W, P = both[..., : F12.shape[-1]], both[..., F12.shape[-1] :]
        return cls(P, W, F21 @ P, sign, log), F22 - F21 @ W

    def forward(self, y1, y2):
        return self.P @ y1, y2 - self.V @ y1

    def backward(self, z, x2):
        return z - self.W @ x2

    @property
    def T(self):
        return Lu(_T(self.P), _T(self.V), _T(self.W), self.sign, self.log)

    def log_determinant(self):
        return self.sign, self.log

    def negatives(self):
        raise ValueError("the inertia of a matrix needs its symmetric factorisation: factor(matrix, 'ldl')")


KINDS = {"cholesky": Cholesky, "ldl": Ldl, "lu": Lu}


def _lower_solve(L, B, transposed=False):
    return linalg.triangular_solve(L, B, left_side=True, lower=True, transpose_a=transposed)


def _lower_inverse(L, base):
    """L^-1 by halves: products of small matrices are cheaper than triangular solves."""
    n, half = L.shape[-1], L.shape[-1] // 2
    if n <= base:
        return _lower_solve(L, _eye_like(L))
    A, D = _lower_inverse(L[..., :half, :half], base), _lower_inverse(L[..., half:, half:], base)
    B = -(D @ L[..., half:, :half]) @ A
    upper = jnp.concatenate([A, jnp.zeros_like(jnp.swapaxes(B, -1, -2))], axis=-1)
    return jnp.concatenate([upper, jnp.concatenate([B, D], axis=-1)], axis=-2)


def _solve_with_determinant(F, B):
    """F^-1 B, and sign and logarithm of the determinant of F."""
    LU, piv, permutation = linalg.lu(F)
    diagonal = jnp.diagonal(LU, axis1=-2, axis2=-1)
    swaps = jnp.sum(piv != jnp.broadcast_to(jnp.arange(piv.shape[-1], dtype=piv.dtype), piv.shape), axis=-1)
    size = jnp.abs(diagonal)
    phase = jnp.prod(diagonal / jnp.where(size == 0, 1, size).astype(diagonal.dtype), axis=-1)
    B = jnp.take_along_axis(B, permutation[..., None], axis=-2)
    X = linalg.triangular_solve(LU, B, left_side=True, lower=True, unit_diagonal=True)
    X = linalg.triangular_solve(LU, X, left_side=True, lower=False)
    return X, jnp.where(swaps % 2 == 1, -phase, phase), jnp.sum(jnp.log(size), axis=-1)
