"""Motions without strain of a stiffness: the coordinates that nothing holds, by name in messages."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Array, Float

from ..errors import ModelError
from ..typing import AnyArray, RowsLike
from ._condensation import interface_basis, partition

#: Eigenvalue of a stiffness with unit diagonal, in units of rounding, that is taken for zero.
_ZERO = 1e3
_SHARE = 1e-3  # entry of a motion, over its largest, that is part of it
_NAMED = 4  # coordinates named in a message


def free_coordinates(stiffness: AnyArray) -> tuple[int, np.ndarray]:
    """Number of motions without strain of a concrete stiffness (n, n), and the rows (k,) that have part in them."""
    K = np.asarray(stiffness)
    size = np.sqrt(np.where(np.diagonal(K) > 0, np.diagonal(K), 1.0))
    values, shapes = np.linalg.eigh(K / np.outer(size, size))
    free = values < _ZERO * np.finfo(K.dtype).eps
    part = np.max(np.abs(shapes[:, free]), axis=1, initial=0.0)
    return int(np.sum(free)), np.flatnonzero(part > _SHARE * np.max(part, initial=0.0))


def name_some(labels: Sequence[tuple[str, str]], rows: np.ndarray) -> str:
    """Names of coordinates in words, `"0" x, "0" y and 28 more`."""
    words = [" ".join(filter(None, (repr(labels[k][0]), labels[k][1]))) for k in rows[:_NAMED]]
    return ", ".join(words) + (f" and {len(rows) - _NAMED} more" if rows[_NAMED:].any() else "")


def motion_with(system, base: RowsLike) -> Float[Array, "n b"]:
    """Static motion (n, base) of a dense linear system with unit motions of its rows `base`.

    Raises: ModelError, if concrete, with the coordinates that the base does not hold.
    """
    try:
        return interface_basis(system.stiffness, base)
    except ValueError:
        inner, _ = partition(system.num_rows, base)
        _, rows = free_coordinates(np.asarray(system.stiffness)[np.ix_(inner, inner)])
        names = name_some(system.coordinates, inner[rows])
        raise ModelError(
            [f"with the moved coordinates fixed nothing holds {names}: join them with the base by springs"],
            "the question",
        ) from None
