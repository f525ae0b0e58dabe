"""Storage of the matrices of a linear system: dense arrays, block matrices or SciPy sparse matrices."""

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
from ._block_rows import BlockRows

#: Matrices with more rows are not made dense: at 10 000 rows one takes 0.8 GB in double precision.
MAX_DENSE_ROWS = 10000

SciPyMatrix = scipy.sparse.spmatrix | scipy.sparse.sparray
Matrix = Inexact[Array, "n n"] | BlockMatrix | SciPyMatrix
MatrixLike = ArrayLike | BlockMatrix | SciPyMatrix


def unify_storage(faults: list, **given) -> list:
    """Bring matrices to one storage: blocks, SciPy sparse where all are, else dense.  None stays None."""
    values = [A for A in given.values() if A is not None]
    blocks = [isinstance(A, BlockMatrix) for A in values]
    if any(blocks) and not all(blocks):
        faults.append(f"{', '.join(given)}: either all or none of them must be block matrices")
    elif any(blocks) and len({A.pattern for A in values}) > 1:
        faults.append(f"{', '.join(given)}: block matrices must share one pattern")
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
    """Data type of the numbers in a matrix of any storage."""
    return A.diagonal.dtype if isinstance(A, BlockMatrix) else A.dtype


def num_rows(A) -> int:
    """Number of rows of a matrix of any storage, the padding of block matrices included."""
    return A.pattern.num_blocks * A.pattern.size if isinstance(A, BlockMatrix) else A.shape[0]


def to_dense(A, rows: BlockRows | None = None):
    """Convert a matrix of any storage to a dense array.

    Args: rows: of a block matrix, the rows at the places of its blocks; default all places in turn.

    Raises: ModelError for one that is too large.
    """
    if not isinstance(A, BlockMatrix) and not scipy.sparse.issparse(A):
        return A
    if num_rows(A) > MAX_DENSE_ROWS:
        raise ModelError(
            [
                f"a dense matrix of {num_rows(A)} rows is too large (limit {MAX_DENSE_ROWS}): reduce the "
                "component first"
            ]
        )
    if not isinstance(A, BlockMatrix):
        return jnp.asarray(A.toarray())
    full = A.to_dense()
    return full if rows is None else full[np.ix_(rows.places, rows.places)]


def as_inexact(value: Any) -> Array:
    """Convert to a floating or complex array of the same precision; whole numbers become floats.

    So a product with whole numbers does not round its other factor to whole numbers.
    """
    value = jnp.asarray(value)
    return value if jnp.issubdtype(value.dtype, jnp.inexact) else value.astype(float)
