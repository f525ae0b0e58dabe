"""Conversion of SciPy sparse matrices to block matrices for the block-sparse solver."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
import scipy.sparse

from ..blocksparse import BlockMatrix, Pattern
from ._storage import SciPyMatrix


def block_matrices(
    *matrices: SciPyMatrix | np.ndarray, size: int, names: Sequence[str] | None = None
) -> tuple[BlockMatrix, ...]:
    """Convert SciPy sparse matrices to block matrices on one common pattern, on the host.

    Args:
        matrices: (n, n) each.
        size: consecutive rows per block, the coordinates of a node.
        names: names of the blocks.

    An unsymmetric matrix keeps its lower blocks, so that "lu" solves it and the symmetric kinds refuse it.

    Raises: ValueError where the matrices differ in size or their rows do not divide into blocks.
    """
    shapes = {matrix.shape for matrix in matrices}
    n = max(max(shape) for shape in shapes)
    if shapes != {(n, n)} or n % size:
        raise ValueError(f"matrices of shapes {sorted(shapes)} do not divide into square blocks of {size}")
    parts = [_triplets(matrix, size) for matrix in matrices]
    pairs = np.concatenate([np.stack([i, j], axis=1)[i != j] for i, j, _ in parts])
    pattern = Pattern(n // size, size, pairs, names)
    return tuple(_build_block_matrix(pattern, *part) for part in parts)


def _triplets(matrix, size):
    blocks = scipy.sparse.bsr_array(matrix, blocksize=(size, size))
    blocks.sum_duplicates()
    values = np.asarray(jnp.asarray(blocks.data))  # the precision that is in use
    return np.repeat(np.arange(len(blocks.indptr) - 1), np.diff(blocks.indptr)), blocks.indices, values


def _build_block_matrix(pattern, i, j, values):
    n, b = pattern.shape
    diagonal = np.zeros((n, b, b), values.dtype)
    diagonal[i[i == j]] = values[i == j]
    keys = pattern.edges[:, 0] * n + pattern.edges[:, 1]
    halves = np.zeros((2, pattern.num_edges, b, b), values.dtype)
    for half, first, second in ((0, i, j), (1, j, i)):
        chosen = first < second
        halves[half, np.searchsorted(keys, first[chosen] * n + second[chosen])] = values[chosen]
    upper, lower = halves
    limit = 1e-10 * np.abs(values).max(initial=0.0)  # asymmetry by the rounding of an assembly counts as none
    pairs = ((lower, upper), (diagonal, diagonal))
    even = all(np.allclose(a, np.swapaxes(b, 1, 2), rtol=0, atol=limit) for a, b in pairs)
    return BlockMatrix(pattern, *map(jnp.asarray, (diagonal, upper)), None if even else jnp.asarray(lower))
