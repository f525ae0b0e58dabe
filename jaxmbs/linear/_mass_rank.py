"""Rank of a mass matrix: rows whose mass follows from that of others, as of a mass beside its node."""

import numpy as np
from scipy.linalg.lapack import dpotrf, dpstrf
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from ..blocksparse import BlockMatrix
from ..checks import is_concrete

#: A pivot of a mass matrix with ones on its diagonal is rounding below so many units of it, for each row.
UNITS_OF_ROUNDING = 20


def dependent_rows(mass, among) -> list[int]:
    """Rows of a concrete mass matrix (n, n) whose mass follows exactly from that of the rest of `among`.

    The rest has full rank: it is found by Cholesky factors with pivots of the parts that do not couple, scaled to
    ones on their diagonal, so that no ratio of masses counts.  None of a part that is not positive semidefinite.

    Args: among: numbers of rows; the others are left out, with their coupling.
    """
    eps = np.finfo(np.asarray(mass).dtype).eps
    mass = np.asarray(mass, float)
    rows = np.array([k for k in among if mass[k, k] > 0.0], int)
    if not len(rows):
        return []
    own = mass[np.ix_(rows, rows)]
    size = np.sqrt(np.diagonal(own))
    own = own / size[:, None] / size
    _, part = connected_components(csr_array(own), directed=False)
    order = np.argsort(part, kind="stable")
    found: list[int] = []
    for places in np.split(order, np.flatnonzero(np.diff(part[order])) + 1):
        if len(places) > 1:
            found += rows[places[_dependent(own[np.ix_(places, places)], eps)]].tolist()
    return sorted(found)


def _dependent(A, eps):
    """Places of rows of a matrix with ones on its diagonal that are combinations of the others."""
    least = UNITS_OF_ROUNDING * len(A) * eps
    L, failed = dpotrf(A, lower=1)
    if not failed and np.min(np.diagonal(L)) ** 2 > 1e4 * least:  # far from rounding: pivots are not needed
        return np.zeros(0, int)
    L, pivots, rank, _ = dpstrf(A, lower=1, tol=least)
    if rank == len(A):
        return np.zeros(0, int)
    last = pivots[rank:] - 1
    half = L[rank:, :rank]
    rest = A[np.ix_(last, last)] - half @ half.T
    return np.zeros(0, int) if np.max(np.abs(rest)) > 10 * least else np.sort(last)


def rank_of_blocks(mass: BlockMatrix) -> int:
    """Sum of the ranks of the diagonal blocks of a concrete mass matrix: its rank where nodes do not couple."""
    blocks = np.asarray(mass.diagonal, float)
    size = np.sqrt(np.maximum(np.diagonal(blocks, axis1=1, axis2=2), 1e-300))
    values = np.linalg.eigvalsh(blocks / size[:, :, None] / size[:, None, :])
    return int(np.count_nonzero(values > UNITS_OF_ROUNDING * blocks.shape[1] * np.finfo(mass.diagonal.dtype).eps))


def is_dependent_in_blocks(mass: BlockMatrix) -> bool:
    """True if a concrete block on the diagonal of a mass matrix has rows whose mass follows from that of others."""
    if not is_concrete(mass.diagonal):
        return False
    used = np.count_nonzero(np.diagonal(np.asarray(mass.diagonal), axis1=1, axis2=2))
    return rank_of_blocks(mass) < int(used)
