"""LAPACK, one matrix at a time.

jaxlib before 0.11.2 runs a batch of matrices on the threads that wait for its result, so that two batches at once
stop a process for good; a call with one matrix runs where it is made.  Under `vmap` the functions here go through the
batch matrix by matrix on the CPU, and are batched as ever elsewhere.  All take one matrix; for a stack map them.
"""

from functools import lru_cache, partial

import jax
import jax.numpy as jnp
from jax import lax
from jax.custom_batching import custom_vmap

from ._tricks import is_on


def sequential_vmap(function):
    """`function` of arrays, whose `vmap` on the CPU is a loop; reverse mode needs a rule of its own around it."""
    single = custom_vmap(function)

    @single.def_vmap
    def _(size, batched, *args):
        moving = [x for x, is_batched in zip(args, batched, strict=True) if is_batched]

        def call(moved):
            moved = iter(moved)
            return single(*(next(moved) if is_batched else x for x, is_batched in zip(args, batched, strict=True)))

        def in_turn(*moving):
            if size == 1:
                return jax.tree.map(lambda x: x[None], call([x[0] for x in moving]))
            return lax.map(call, moving)

        def together(*moving):
            axes = tuple(0 if is_batched else None for is_batched in batched)
            moved = iter(moving)
            return jax.vmap(function, axes, axis_size=size)(
                *(next(moved) if is_batched else x for x, is_batched in zip(args, batched, strict=True))
            )

        if is_on("sequential_lapack"):
            found = lax.platform_dependent(*moving, cpu=in_turn, default=together)
        else:
            found = together(*moving)
        return found, jax.tree.map(lambda _: True, found)

    return single


#: Of a symmetric or Hermitian matrix: values (n,), rising, and vectors (n, n).  No derivative in reverse mode.
eigh = sequential_vmap(lambda A: tuple(jnp.linalg.eigh(A)))
#: The values (n,) alone.
eigvalsh = sequential_vmap(lambda A: jnp.linalg.eigvalsh(A))
#: Of any square matrix, complex: values (n,) and right vectors (n, n).  No derivative in reverse mode.
eig = sequential_vmap(lambda A: tuple(jnp.linalg.eig(A)))
#: `U (m, k), s (k,), V^H (k, n)`, k = min(m, n).  No derivative in reverse mode.
svd = sequential_vmap(lambda A: tuple(jnp.linalg.svd(A, full_matrices=False)))
#: `Q (m, k), R (k, n)`, k = min(m, n).  No derivative in reverse mode.
qr = sequential_vmap(lambda A: tuple(jnp.linalg.qr(A)))
#: `L U` in one matrix (n, n) and the permutation (n,) of its rows.  No derivative in reverse mode.
lu = sequential_vmap(lambda A: lax.linalg.lu(A)[::2])


def pseudo_inverse(A):
    """`A^+` (n, m), what rounding leaves of singular values dropped.  No derivative in reverse mode."""
    U, s, Vh = svd(A)
    kept = s > max(A.shape) * jnp.finfo(s.dtype).eps * jnp.max(s, initial=0.0)
    scale = jnp.where(kept, 1 / jnp.where(kept, s, 1.0), 0.0).astype(A.dtype)
    return (Vh.T.conj() * scale[None]) @ U.T.conj()


_cholesky = sequential_vmap(lambda A: jnp.linalg.cholesky(A))


@jax.custom_jvp
def cholesky(A):
    """Lower L with `A = L L^T` for A (n, n) symmetric positive definite, real; NaN where it is not."""
    return _cholesky(A)


@cholesky.defjvp
def _cholesky_jvp(primals, tangents):
    """`dL = L half(L^-1 dA L^-T)`."""
    L = cholesky(*primals)
    inner = solve_triangular(L, solve_triangular(L, tangents[0]).T)
    return L, L @ lower_half(inner)


def lower_half(A):
    """The lower triangle of A (n, n), its diagonal halved: of a symmetric matrix, what adds up with its transpose."""
    return jnp.tril(A) - 0.5 * jnp.diag(jnp.diagonal(A))


@lru_cache
def _triangular(lower, transposed, unit):
    """`X` of `L X = B`, B (n, k).  Right sides in a batch of one L are columns of one call."""
    options = dict(left_side=True, lower=lower, transpose_a=transposed, unit_diagonal=unit)
    solve = partial(lax.linalg.triangular_solve, **options)
    in_turn = sequential_vmap(solve)
    beside = custom_vmap(solve)

    @beside.def_vmap
    def _(size, batched, L, B):
        if batched[0]:
            return jax.vmap(in_turn, tuple(0 if b else None for b in batched))(L, B), True
        columns = jnp.moveaxis(B, 0, 1).reshape(B.shape[1], -1)
        return jnp.moveaxis(beside(L, columns).reshape(B.shape[1], size, -1), 1, 0), True

    return beside


def solve_factor(L, B, lower=True, transposed=False, unit=False):
    """`L^-1 B`, or `L^-T B`, for L (n, n) triangular and B (n, k); no derivative in reverse mode."""
    return _triangular(lower, transposed, unit)(L, B)


def solve_triangular(L, B, lower=True, transposed=False):
    """`L^-1 B`, or `L^-T B`, for L (n, n) triangular and B (n,) or (n, k); derivatives of every order."""
    fixed = lax.stop_gradient(L)
    half = jnp.tril if lower else jnp.triu

    def by(transposed):
        return lambda _, B: solve_factor(fixed, B, lower, transposed)

    def apply(X):
        return half(L).T @ X if transposed else half(L) @ X

    X = B[:, None] if B.ndim == 1 else B
    return lax.custom_linear_solve(apply, X, by(transposed), by(not transposed)).reshape(B.shape)


def solve_positive(A, B, L=None):
    """`A^-1 B` for A (n, n) symmetric positive definite, real, B (n,) or (n, k), and L of `cholesky` if known.

    Derivatives of every order.  NaN where A is not positive definite.
    """
    L = lax.stop_gradient(_cholesky(lax.stop_gradient(A)) if L is None else L)

    def solve(_, B):
        return solve_factor(L, solve_factor(L, B), transposed=True)

    X = B[:, None] if B.ndim == 1 else B
    return lax.custom_linear_solve(lambda X: A @ X, X, solve, symmetric=True).reshape(B.shape)
