"""Rank and null spaces of sparse constraint rows, by inverse iteration on their normal matrix.

Singular values are found as sizes of `A z`, not as roots of eigenvalues, so that they are right down to rounding.
"""

from typing import Any

import numpy as np

_SEED = 11  # of the vectors that the iteration starts from: any, but always the same
_PASSES = 4  # of the iteration; each takes singular values of 10 tolerances to a thousandth
_PROBES = 8  # random self-stresses
_ROUNDS = 30  # of a least-norm step, at most; regular rows take two


def sparse_spaces(A: Any, tolerance: float, least: float) -> tuple[int, np.ndarray, np.ndarray]:
    """As `constraint_spaces`, for sparse rows A (rows, nv): of A^T random vectors of the null space (rows, <= 8).

    Args:
        tolerance: singular values that count as zero, relative to the largest one, or to `least` if that is larger.
    """
    from scipy.sparse import csr_array

    rows, n = A.shape
    A, random = csr_array(A, dtype=float), np.random.default_rng(_SEED)
    threshold = tolerance * max(_largest_singular_value(A, random), least)
    k = max(n - rows, 0) + _PROBES
    while 2 * k < n:
        size, Z = _smallest_singular_values(A, threshold, random.normal(size=(n, k)))
        if size[-1] > threshold:  # all of the null space is among them
            break
        k *= 2
    else:
        _, size, Vt = np.linalg.svd(A.toarray())
        size, Z = np.r_[size, np.zeros(n - len(size))][::-1], Vt[::-1].T
    Z = Z[:, : np.count_nonzero(size <= threshold)]
    rank = n - Z.shape[1]
    probes = np.random.default_rng(_SEED).normal(size=(rows, min(_PROBES, rows - rank)))
    return rank, Z, _without_range(A, threshold, probes) if rank < rows else probes


def least_norm_solution(A: Any, gap: np.ndarray, tolerance: float) -> np.ndarray:
    """The least x (nv,) with the least |A x - gap|; singular values below the tolerance, relative, take no part."""
    from scipy.sparse import csr_array

    A = csr_array(A, dtype=float)
    largest, x = _largest_singular_value(A, np.random.default_rng(_SEED)), np.zeros(A.shape[1])
    # rounding over the damping adds motions of the null space: the smaller one only closes what the larger left
    for damping in (1e-8, 10.0 * tolerance**2):
        solve, left = damped_solver(A, damping * largest**2 + 1e-300), np.inf
        for _ in range(_ROUNDS):
            rest = gap - A @ x
            size = np.linalg.norm(rest)
            if not 1e-12 * np.linalg.norm(gap) < size < 0.5 * left:  # rounding, or what no step closes
                break
            x, left = x + solve(A.T @ rest), size
    return x


def damped_solver(A: Any, damping: Any):
    """Function that solves with `A^T A + damping`, one number or (nv,), for right-hand sides (nv, ...)."""
    from scipy.sparse import diags_array
    from scipy.sparse.linalg import splu

    normal = A.T @ A + diags_array(np.broadcast_to(damping, A.shape[1]).astype(A.dtype))
    options = {"SymmetricMode": True}
    return splu(normal.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options).solve


def scaled_columns(A: Any, factors: np.ndarray) -> Any:
    """Sparse rows A (rows, nv) times factors (nv,)."""
    from scipy.sparse import diags_array

    return A @ diags_array(factors)


def _largest_singular_value(A, random):
    x = random.normal(size=A.shape[1])
    for _ in range(20):  # within some percent, which a tolerance does not feel
        x = A.T @ (A @ (x / max(np.linalg.norm(x), 1e-300)))
    return np.sqrt(np.linalg.norm(x))


def _smallest_singular_values(A, threshold, start):
    """Singular values of A, rising, and vectors (nv, k) for the smallest ones."""
    solve, Z = damped_solver(A, 10.0 * threshold**2 + 1e-300), start
    for _ in range(_PASSES):
        Z = np.linalg.qr(solve(Z))[0]
    _, size, Vt = np.linalg.svd(A @ Z, full_matrices=False)
    return size[::-1], Z @ Vt[::-1].T


def _without_range(A, threshold, probes):
    """Vectors (rows, k) less their parts in the range of A."""
    solve = damped_solver(A, 10.0 * threshold**2)
    for _ in range(2 * _PASSES):
        probes = probes - A @ solve(A.T @ probes)
    return probes
