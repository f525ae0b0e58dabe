"""Rows of a linear system at the places of its blocks, and vectors in either order."""

import hashlib

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..blocksparse import Pattern
from ..typing import AnyArray, ArrayLike


class NumberTable:
    """A static table of whole numbers; equal ones hash alike."""

    def __init__(self, numbers: ArrayLike) -> None:
        self.numbers = np.asarray(numbers, np.int32)
        self._key = (self.numbers.shape, hashlib.sha256(self.numbers.tobytes()).digest())
        self._hash = hash(self._key)

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        return self is other or (isinstance(other, NumberTable) and self._key == other._key)

    def __repr__(self) -> str:
        return f"NumberTable({' x '.join(map(str, self.numbers.shape))})"


class BlockRows(NumberTable):
    """Row of every place of the blocks.

    Args: numbers: (blocks, size), each row once; -1 where a block is padded.
    """

    def __init__(self, numbers: np.ndarray) -> None:
        super().__init__(numbers)
        padding = np.count_nonzero(self.numbers < 0)
        self.places = np.argsort(self.numbers, axis=None, kind="stable")[padding:]

    def __len__(self) -> int:
        return len(self.places)


def to_blocks(x: AnyArray, pattern: Pattern, rows: BlockRows | None = None) -> Array:
    """Vectors x (n, ...) in blocks (blocks, size, ...), zero on padding; by default all places in turn."""
    x = jnp.asarray(x)
    if rows is None:
        return x.reshape(*pattern.shape, *x.shape[1:])
    return jnp.concatenate([x, jnp.zeros_like(x[:1])])[np.where(rows.numbers < 0, len(x), rows.numbers)]


def from_blocks(X: AnyArray, rows: BlockRows | None = None) -> Array:
    """Vectors X (blocks, size, ...) in the order of the rows (n, ...); by default all places in turn."""
    flat = jnp.reshape(X, (-1, *X.shape[2:]))
    return flat if rows is None else flat[rows.places]
