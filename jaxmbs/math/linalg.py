"""Linear algebra that keeps its derivatives: saddle systems with redundant rows, full-column-rank least squares."""

import jax
import jax.numpy as jnp
from jax import lax

#: Weight of the lower block of a saddle system, relative to the rows' own scale A diag(M)^-1 A^T.
PROXIMAL = 1e-8


def saddle_factor(M, A, weight=PROXIMAL):
    """LU factors of `[M A^T; A -eps C]`, C diagonal in the scale of each row; no derivative passes.

    Works for redundant but consistent rows and for M singular outside the null space of A.
    """
    M, A = lax.stop_gradient((M, A))
    n, m = M.shape[0], A.shape[0]
    diagonal = jnp.diagonal(M)
    diagonal = jnp.maximum(diagonal, 1e-9 * jnp.max(diagonal, initial=1e-30))
    C = jnp.sum(A * A / diagonal[None, :], axis=1)
    C = weight * jnp.where(C > 0, C, 1.0)
    K = jnp.block([[M, A.T], [A, -jnp.diag(C)]]) if m else M
    return jax.scipy.linalg.lu_factor(K), C, n


def saddle_solve(M, A, b, c, factor=None, iterations=2):
    """Solution (x, y) of `M x + A^T y = b`, `A x = c`, by proximal iterations on one factor.

    Redundant consistent rows leave x unique and give some y; both have derivatives of every order.  Costs one
    factorisation; its adjoint reuses it.
    """
    (lu, C, n) = saddle_factor(M, A) if factor is None else factor
    C = lax.stop_gradient(C)
    lu = lax.stop_gradient(lu)

    def apply(z):
        x, y = z[:n], z[n:]
        return jnp.concatenate([M @ x + A.T @ y, A @ x - C * y])

    def solve(right):
        return lax.custom_linear_solve(
            apply,
            right,
            lambda _, r: jax.scipy.linalg.lu_solve(lu, r),
            lambda _, r: jax.scipy.linalg.lu_solve(lu, r),
            symmetric=True,
        )

    y = jnp.zeros_like(c)
    for _ in range(iterations):
        z = solve(jnp.concatenate([b, c - C * y]))
        y = z[n:]
    return z[:n], y


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
