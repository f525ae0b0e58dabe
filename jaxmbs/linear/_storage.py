"""Matrices of a linear system by the type they come in: dense arrays, blocks, or SciPy's sparse matrices."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import scipy.sparse
from jaxtyping import Array, Inexact

from ..blocksparse import BlockMatrix
from ..checks import is_concrete
from ..elements._base import as_real
from ..errors import ModelError
from ..typing import ArrayLike

#: Above this many coordinates a matrix is not made dense: reduce the component first.
MAX_DENSE_ROWS = 10000

SciPyMatrix = scipy.sparse.spmatrix | scipy.sparse.sparray
Matrix = Inexact[Array, "n n"] | BlockMatrix | SciPyMatrix
MatrixLike = ArrayLike | BlockMatrix | SciPyMatrix  # what a linear system is made of


def unify_storage(faults: list, **given) -> list:
    """The matrices in one storage: blocks, SciPy's where all are SciPy's, else dense.  None stays None."""
    values = [A for A in given.values() if A is not None]
    blocks = [isinstance(A, BlockMatrix) for A in values]
    if any(blocks) and not all(blocks):
        faults.append(f"{', '.join(given)}: some are block matrices; let all of them be")
    elif any(blocks) and len({A.pattern for A in values}) > 1:
        faults.append(f"{', '.join(given)}: block matrices must be on one pattern")
    elif not any(blocks):
        sparse = all(map(scipy.sparse.issparse, values))
        given = {name: A if A is None else _as_square_matrix(name, A, sparse, faults) for name, A in given.items()}
    return list(given.values())


def _as_square_matrix(name, A, sparse, faults):
    shape = tuple(A.shape) if hasattr(A, "shape") else np.shape(A)
    if len(shape) != 2 or shape[0] != shape[1]:
        faults.append(f"{name} must be a square matrix, got shape {shape}")
        return jnp.zeros((1, 1))
    if not sparse:
        try:
            A = to_dense(A)
        except ModelError as error:
            faults += error.faults
            return jnp.zeros((1, 1))
        A = jnp.asarray(A) if jnp.iscomplexobj(A) else as_real(A)
    values = A.data if sparse else A
    if is_concrete(values) and not np.all(np.isfinite(np.asarray(values))):
        places = np.argwhere(~np.isfinite(np.asarray(A.toarray() if sparse else A)))
        faults.append(f"{name} is not finite at row {places[0][0]}, column {places[0][1]}")
    return A


def dtype_of(A):
    """Of the numbers in a matrix of any storage."""
    return A.diagonal.dtype if isinstance(A, BlockMatrix) else A.dtype


def num_rows(A) -> int:
    """Rows of a matrix in any storage; those of blocks with their padding."""
    return A.pattern.num_blocks * A.pattern.size if isinstance(A, BlockMatrix) else A.shape[0]


def to_dense(A):
    """The full matrix.  Raises: ModelError for one that is too large."""
    if not isinstance(A, BlockMatrix) and not scipy.sparse.issparse(A):
        return A
    if num_rows(A) > MAX_DENSE_ROWS:
        raise ModelError(
            [f"{num_rows(A)} rows, more than {MAX_DENSE_ROWS}, are too many for a dense matrix: reduce first"]
        )
    return A.to_dense() if isinstance(A, BlockMatrix) else jnp.asarray(A.toarray())


def as_inexact(value: Any) -> Array:
    """An array in the precision it comes in; whole numbers become floats, not what they are multiplied by whole."""
    value = jnp.asarray(value)
    return value if jnp.issubdtype(value.dtype, jnp.inexact) else value.astype(float)
