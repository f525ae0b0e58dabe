"""Parts of a tape: plain arrays and places."""

import math
from typing import Any, NamedTuple

import numpy as np

from ._rows import TapeError
from ._validate import validate


class Place(NamedTuple):
    """An input or a result: where it lies in the arena, if one double stands for all its numbers, shape and type.

    A complex one has two of them, of its real and of its imaginary part.
    """

    start: int
    is_splat: bool
    shape: tuple[int, ...]
    dtype: np.dtype

    @property
    def size(self) -> int:
        """Number of its numbers."""
        return math.prod(self.shape)


def by_array(places: list[Place]) -> list[tuple[Place, ...]]:
    """The places of each array: one, or two of a complex one.  Raises: TapeError for half of one."""
    found: list[tuple[Place, ...]] = []
    rest = iter(places)
    for place in rest:
        if place.dtype != np.complex128:
            found.append((place,))
            continue
        imaginary = next(rest, None)
        if imaginary is None or imaginary[2:] != place[2:]:
            raise TapeError("a complex input or result of the tape has no imaginary part")
        found.append((place, imaginary))
    return found


class Parts(NamedTuple):
    """Instructions (number, fields), starts of the tapes in them, tables, doubles of the arena, constants and their
    places in it, inputs and results, and numbers that may be looked at while it runs."""

    code: np.ndarray
    starts: np.ndarray
    tables: np.ndarray
    size: int
    constants: list[tuple[int, np.ndarray]]
    inputs: list[Place]
    outputs: list[Place]
    shown: list[Place]

    def validated(self) -> "Parts":
        """The same.  Raises: TapeError if something would be read or written outside of the arena or the tables."""
        places: list[tuple[int, Any]] = [(start, numbers.size) for start, numbers in self.constants]
        places += [(place.start, place.size) for place in self.inputs]
        places += [(place.start, 1 if place.is_splat else place.size) for place in self.outputs]
        places += [(place.start, place.size) for place in self.shown]
        validate(self.code, self.starts, self.tables, self.size, places)
        return self
