"""The arena of a tape: where each array lies, and for how long."""

from typing import Any

import numpy as np

from ._flatten import TooLargeError


class Buffer:
    """Consecutive doubles of the arena.

    `views` counts the arrays that lie in it and are needed later; `is_owned`: it goes back to the arena after the
    last one, `is_writable`: the last array in it may be changed in place.  `origin`: the buffer of an outer tape that
    this one stands for.
    """

    __slots__ = ("place", "size", "views", "is_owned", "is_writable", "origin")

    def __init__(self, place: int, size: int, is_owned=True, is_writable=True, origin: "Buffer | None" = None):
        self.place, self.size, self.views = place, size, 0
        self.is_owned, self.is_writable, self.origin = is_owned, is_writable, origin


class Value:
    """An array in the arena; `is_splat`: one double stands for all its numbers; `constant`: these, if known."""

    __slots__ = ("buffer", "place", "is_splat", "constant")

    def __init__(self, buffer: Buffer, place: int, is_splat: bool = False, constant: Any = None):
        self.buffer, self.place, self.is_splat, self.constant = buffer, place, is_splat, constant

    def with_constant(self, constant: Any) -> "Value":
        """The same numbers in another shape."""
        return Value(self.buffer, self.place, self.is_splat, constant)


class Arena:
    """Places for arrays, constants and tables, given out and taken back while a tape is written."""

    def __init__(self, most: float):
        self.size, self._most = 0, most
        self._free: dict[int, list[int]] = {}
        self.constants: list[tuple[int, np.ndarray]] = []
        self._known: dict[tuple, Value] = {}
        self.tables: list[np.ndarray] = []
        self._places: dict[bytes, int] = {}
        self._table_size = 0

    def buffer(self, size: int, is_lasting: bool = False) -> Buffer:
        """A buffer for `size` doubles; a lasting one is never given out again."""
        room = -(-max(size, 1) // 4) * 4  # by fours, so that arrays of nearly the same size share places
        free = self._free.get(room)
        if free and not is_lasting:
            return Buffer(free.pop(), room)
        place, self.size = self.size, self.size + room
        self._claim(self.size)
        return Buffer(place, room, is_owned=not is_lasting, is_writable=not is_lasting)

    def release(self, buffer: Buffer) -> None:
        """Take an owned buffer back."""
        if buffer.is_owned:
            self._free.setdefault(buffer.size, []).append(buffer.place)

    def constant(self, array: np.ndarray) -> Value:
        """A constant array; the same numbers lie in one place."""
        numbers = np.asarray(array, np.float64).reshape(-1)
        if numbers.size > 1 and np.all(numbers.view(np.int64) == numbers.view(np.int64)[0]):
            numbers = numbers[:1]
        key = (array.shape, array.dtype.str, numbers.tobytes())
        if key not in self._known:
            buffer = self.buffer(numbers.size, is_lasting=True)
            self.constants.append((buffer.place, numbers.copy()))
            self._known[key] = Value(buffer, buffer.place, numbers.size == 1, array)
        return self._known[key]

    def table(self, *parts: Any) -> int:
        """Place of a table of whole numbers; equal ones lie in one place."""
        numbers = np.concatenate([np.asarray(part, np.int64).reshape(-1) for part in parts])
        key = numbers.tobytes()
        if key not in self._places:
            self._places[key] = self._table_size
            self._table_size += numbers.size
            self._claim(self._table_size)
            self.tables.append(numbers)
        return self._places[key]

    def _claim(self, size: int) -> None:
        # at once: tables of a large program take longer to write than it takes to compile
        if size > self._most:
            raise TooLargeError(f"more than {self._most:,.0f} numbers")

    def all_tables(self) -> np.ndarray:
        """All tables, one after another."""
        return np.concatenate([*self.tables, np.zeros(1, np.int64)])
