"""What the matrices of a linear system must be: symmetric, finite, with mass everywhere."""

import jax.numpy as jnp
import numpy as np
from jax import lax

from ..checks import is_concrete

#: The part of a matrix's largest entry that may be unsymmetric.
ASYMMETRY_TOLERANCE = 1e-5


def require_symmetric(**matrices) -> tuple:
    """The matrices, in order; under tracing an unsymmetric one is NaN.  Raises: as `check_symmetric`."""
    check_symmetric(**matrices)
    return tuple(A if is_concrete(A) else _nan_if_unsymmetric(A) for A in matrices.values())


def _nan_if_unsymmetric(A):
    fixed = lax.stop_gradient(A)
    part, size = jnp.max(jnp.abs(fixed - fixed.T), initial=0.0), jnp.max(jnp.abs(fixed), initial=0.0)
    return A + jnp.where(part > ASYMMETRY_TOLERANCE * size, jnp.nan, 0.0).astype(A.dtype)


def check_symmetric(**matrices) -> None:
    """Raises: ValueError for matrices that are not square and of one size; if concrete, for one that is not finite.

    Also for one that is unsymmetric by more than 1e-5 of its largest entry.
    """
    shapes = {name: tuple(A.shape) for name, A in matrices.items() if A is not None}
    if len(set(shapes.values())) > 1 or any(len(s) != 2 or s[0] != s[1] for s in shapes.values()):
        raise ValueError(f"{', '.join(shapes)} must be square and alike, not of shapes {list(shapes.values())}")
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
    """Raises: ValueError for coordinates without mass, if concrete."""
    if not is_concrete(M) or M.shape[0] == 0:
        return
    M = np.asarray(M)
    bare = np.flatnonzero(np.diagonal(M) <= 0)
    if len(bare):
        raise ValueError(
            f"coordinates {bare.tolist()} have no mass: give a LinearSystem, whose modes, frequency_response, "
            "simulate and reduce condense such rows, or condense these matrices first (Guyan)"
        )
