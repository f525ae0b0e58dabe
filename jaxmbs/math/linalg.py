"""Linear algebra that keeps its derivatives: saddle systems with redundant rows, full-column-rank least squares."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

#: Weight of the lower block of a saddle system, relative to the largest of diag(A diag(M)^-1 A^T) (double, single).
#: Motions through singular poses (A02, 10 s) err 2e-8 at 1e-8, 5e-9 here, 2e-8 at 1e-10, 1e-7 at 1e-11.
PROXIMAL = {8: 3e-10, 4: 1e-5}


class RowScale(NamedTuple):
    """Units of constraint rows: `unit` (rows,) brings rows to one unit, `block` (rows,) numbers their elements."""

    unit: jax.Array
    block: np.ndarray


def _row_mobility(M, A, block):
    """Scale (rows,) of A M^-1 A^T: one for all rows of an element.

    A row that vanishes at a singular pose fades out there and is not blown up; light and heavy elements keep theirs.
    """
    diagonal = jnp.diagonal(M)
    massless = diagonal <= 1e-9 * jnp.max(diagonal, initial=1e-30)  # columns that must not set the scale
    mobility = jnp.where(massless, 0.0, 1.0 / jnp.where(massless, 1.0, diagonal))
    size = jnp.sum(A * A * mobility[None, :], axis=1)
    together = block[:, None] == block[None, :]
    of_block = jnp.max(jnp.where(together, size[None, :], 0.0), axis=1, initial=0.0)
    return jnp.maximum(of_block, 1e-12 * jnp.max(size, initial=1e-18))


def saddle_factor(M, A, block):
    """LU factors of `[M A^T; A -eps C]` and the diagonal eps C (rows,); no derivative passes.

    Works for redundant but consistent rows, and for M singular outside the null space of A.
    """
    M, A = lax.stop_gradient((M, A))
    if A.shape[0] == 0:
        return jax.scipy.linalg.lu_factor(M), jnp.zeros(0, M.dtype)
    C = PROXIMAL[M.dtype.itemsize] * _row_mobility(M, A, block)
    return jax.scipy.linalg.lu_factor(jnp.block([[M, A.T], [A, -jnp.diag(C)]])), C


def saddle_solve(M, A, b, c, rows: RowScale | None = None, iterations=2):
    """Solution (x, y) of `M x + A^T y = b`, `A x = c`, by proximal iterations on one factor.

    Redundant consistent rows leave x unique and give some y; both have derivatives of every order.  Costs one
    factorisation; its adjoint reuses it.

    Args: M (n, n), A (m, n), b (n,), c (m,); rows: units and elements of the rows (default: one element).
    """
    n = M.shape[0]
    unit, block = (jnp.ones_like(c), np.zeros(c.shape[0], int)) if rows is None else rows
    A, c = unit[:, None] * A, unit * c
    lu, C = lax.stop_gradient(saddle_factor(M, A, block))

    def apply(z):
        x, y = z[:n], z[n:]
        return jnp.concatenate([M @ x + A.T @ y, A @ x - C * y])

    def inverse(_, right):
        return jax.scipy.linalg.lu_solve(lu, right)

    y = jnp.zeros_like(c)
    for _ in range(iterations):
        right = jnp.concatenate([b, c - C * y])
        z = lax.custom_linear_solve(apply, right, inverse, inverse, symmetric=True)
        y = z[n:]
    return z[:n], unit * y


@jax.custom_jvp
def small_matmul(A, B):
    """A @ B for batches of matrices with few inner columns, as a sum of outer products.

    On the CPU five times faster than the batched product of 6 by 6 matrices; its derivative takes that product,
    whose transpose is cheaper.
    """
    terms = [A[..., :, k, None] * B[..., k, None, :] for k in range(A.shape[-1])]
    return sum(terms) if terms else A @ B


@small_matmul.defjvp
def _small_matmul_jvp(primals, tangents):
    (A, B), (dA, dB) = primals, tangents
    return small_matmul(A, B), dA @ B + A @ dB


def full_rank_lstsq(B, right):
    """Solution of `B X = right` for B (m, n) of full column rank n <= m, by QR; consistent rows do no harm."""
    Q, R = jnp.linalg.qr(B)
    return jax.scipy.linalg.solve_triangular(R, Q.T @ right)


def safe_norm(x):
    """Length of x (n,) with zero derivative at zero."""
    square = jnp.sum(x * x)
    positive = square > 0
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, square, 1.0)), 0.0)


def direction(x):
    """Unit vector of x (n,), zero at zero."""
    square = jnp.sum(x * x)
    positive = square > 0
    return x * jnp.where(positive, lax.rsqrt(jnp.where(positive, square, 1.0)), 0.0)


_LEVI_CIVITA = np.zeros((3, 3, 3))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _LEVI_CIVITA[_i, _k, _j], _LEVI_CIVITA[_i, _j, _k] = 1.0, -1.0


def skew(a):
    """Matrix (3, 3) of the vector product: `skew(a) @ b = a x b`; also `skew(a) @ R` for columns."""
    return jnp.tensordot(jnp.asarray(_LEVI_CIVITA, a.dtype), a, axes=([2], [0]))
