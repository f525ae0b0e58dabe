"""Validation of the matrices of a linear system: symmetric, finite, with mass on every row."""

import jax.numpy as jnp
import numpy as np
from jax import lax

from ..blocksparse import BlockMatrix
from ..checks import is_concrete
from ._mass_rank import dependent_rows

#: Allowed asymmetry relative to the largest entry: that of matrices written to files with six digits.
ASYMMETRY_TOLERANCE = 1e-5


def require_symmetric(**matrices) -> tuple:
    """Check matrices as `check_symmetric` and return them; under tracing an unsymmetric one becomes NaN."""
    check_symmetric(**matrices)
    return tuple(A if is_concrete(A) else _nan_if_unsymmetric(A) for A in matrices.values())


def _nan_if_unsymmetric(A):
    fixed = lax.stop_gradient(A)
    part, size = jnp.max(jnp.abs(fixed - fixed.T), initial=0.0), jnp.max(jnp.abs(fixed), initial=0.0)
    return A + jnp.where(part > ASYMMETRY_TOLERANCE * size, jnp.nan, 0.0).astype(A.dtype)


def check_symmetric(**matrices) -> None:
    """Refuse matrices that are not square, of one size and, if concrete, finite and symmetric to ASYMMETRY_TOLERANCE.

    Raises: ValueError.
    """
    shapes = {name: tuple(A.shape) for name, A in matrices.items() if A is not None}
    if len(set(shapes.values())) > 1 or any(len(s) != 2 or s[0] != s[1] for s in shapes.values()):
        raise ValueError(f"{', '.join(shapes)} must be square and of one size, not of shapes {list(shapes.values())}")
    for name, A in matrices.items():
        if A is None or not is_concrete(A):
            continue
        A = np.asarray(A)
        if not np.all(np.isfinite(A)):
            raise ValueError(f"the {name} is not finite")
        part = np.max(np.abs(A - A.T), initial=0.0) / max(np.max(np.abs(A), initial=0.0), 1e-300)
        if part > ASYMMETRY_TOLERANCE:
            raise ValueError(f"the {name} is unsymmetric by {part:.1g} of its largest entry")


def check_mass(M) -> None:
    """Refuse a mass matrix with rows without mass of their own, if concrete.  Raises: ValueError."""
    if not is_concrete(M) or M.shape[0] == 0:
        return
    M = np.asarray(M)
    bare = sorted({*np.flatnonzero(np.diagonal(M) <= 0).tolist(), *dependent_rows(M, range(len(M)))})
    if bare:
        raise ValueError(
            f"the mass matrix is not positive definite: coordinates {bare} have no mass of their own; pass a "
            "LinearSystem to modes, frequency_response, simulate or reduce, which condense such rows, or condense "
            "the matrices first (Guyan)"
        )


def symmetric_blocks(A: BlockMatrix) -> BlockMatrix:
    """A symmetric block matrix without lower blocks; under tracing an unsymmetric one becomes NaN.

    Raises: ValueError, if concrete, for an unsymmetric matrix.
    """
    if A.is_symmetric:
        return A
    part = jnp.maximum(_largest(A.upper - jnp.swapaxes(A.lower_blocks, 1, 2)), A.asymmetry * _largest(A.diagonal))
    uneven = part > ASYMMETRY_TOLERANCE * jnp.maximum(_largest(A.diagonal), _largest(A.upper))
    if is_concrete(uneven) and uneven:
        raise ValueError("a matrix in blocks is unsymmetric, but this function needs symmetric ones")
    spoilt = jnp.where(uneven, jnp.nan, 0.0).astype(A.diagonal.dtype)
    return BlockMatrix(A.pattern, (A.diagonal + A.T.diagonal) / 2 + lax.stop_gradient(spoilt), A.upper)


def _largest(A):
    return jnp.max(jnp.abs(A), initial=0.0)
