"""Linear algebra that keeps its derivatives: saddle systems with redundant rows, full-column-rank least squares."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

#: Weight of the lower block of a saddle system, relative to the largest row of A diag(M)^-1 A^T (double, single).
#: Motions through singular poses (A02, 10 s) err 2e-8 at 1e-8, 5e-9 here, 2e-8 at 1e-10, 1e-7 at 1e-11.
PROXIMAL = {8: 3e-10, 4: 1e-5}


def saddle_factor(M, A):
    """LU factors of `[M A^T; A -eps C]`, C one scale for all rows; no derivative passes.

    Works for redundant but consistent rows, for rows that vanish at a singular pose (one scale for all: a row must
    fade out there, not be blown up), and for M singular outside the null space of A.
    """
    M, A = lax.stop_gradient((M, A))
    m = A.shape[0]
    diagonal = jnp.diagonal(M)
    massless = diagonal <= 1e-9 * jnp.max(diagonal, initial=1e-30)  # columns that must not set the scale
    mobility = jnp.where(massless, 0.0, 1.0 / jnp.where(massless, 1.0, diagonal))
    C = PROXIMAL[M.dtype.itemsize] * jnp.max(jnp.sum(A * A * mobility[None, :], axis=1), initial=1e-30)
    K = jnp.block([[M, A.T], [A, -C * jnp.eye(m, dtype=M.dtype)]]) if m else M
    return jax.scipy.linalg.lu_factor(K), C


def saddle_solve(M, A, b, c, scale=None, iterations=2):
    """Solution (x, y) of `M x + A^T y = b`, `A x = c`, by proximal iterations on one factor.

    Redundant consistent rows leave x unique and give some y; both have derivatives of every order.  Costs one
    factorisation; its adjoint reuses it.

    Args: M (n, n), A (m, n), b (n,), c (m,); scale (m,) brings the rows to one unit.
    """
    n = M.shape[0]
    if scale is not None:
        A, c = scale[:, None] * A, scale * c
    lu, C = lax.stop_gradient(saddle_factor(M, A))

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
    return z[:n], (y if scale is None else scale * y)


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
