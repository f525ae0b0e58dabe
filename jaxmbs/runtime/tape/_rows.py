"""Instructions of a tape as columns of numbers, and claims about where they read and write.

Columns are doubles: bounds are sums and products of numbers that are not negative, exact to 2^53, and they do not
wrap round beyond.
"""

from typing import NamedTuple

import numpy as np

from ._opcodes import FIELDS, NAMES

#: Most lines of tables of one kind together.
_MOST_LINES = 10_000_000


class TapeError(ValueError):
    """A tape that would read or write where it must not."""


class Space(NamedTuple):
    """The code with the tape of each instruction, tables and a number after them, numbers of tapes and of doubles.

    Tapes inside of others are noted in it, as (outer, inner).
    """

    code: np.ndarray
    owners: np.ndarray
    tables: np.ndarray
    num_tapes: int
    size: int
    nesting: list[tuple[np.ndarray, np.ndarray]]


class Rows:
    """Instructions of one kind, a column for each field, and what they may use.

    Args:
        space: the code and what belongs to it.
        rows: numbers of the instructions, in which one may stand more than once.
    """

    def __init__(self, space: Space, rows: np.ndarray):
        self.space, self.rows, self.own = space, rows, space.code[rows]
        self._column = dict(zip(FIELDS, self.own.T.astype(np.float64), strict=True))
        self.claim(self["n"] >= 0, "fewer than no numbers")
        for name in ("out", "a", "b", "c"):  # the machine forms all addresses, used or not
            self.within(self[name], 0)
        self.table(np.zeros(1))

    def __getitem__(self, field: str) -> np.ndarray:
        return self._column[field]

    def claim(self, is_good: np.ndarray, fault: str) -> None:
        """Raises: TapeError, which names the first instruction of which it does not hold."""
        if not np.all(is_good):
            first = int(np.argmin(is_good))
            raise TapeError(f"instruction {self.rows[first]} of the tape ({NAMES[self.own[first, 0]]}) has {fault}")

    def within(self, start: np.ndarray, length: np.ndarray | float | int) -> None:
        """Claim numbers of the arena."""
        self.claim(self.has(start, length), "numbers outside of the arena")

    def has(self, start: np.ndarray | int, length: np.ndarray | float | int) -> np.ndarray:
        """True where there are such numbers in the arena."""
        return np.asarray((start >= 0) & (start + length <= self.space.size))

    def result(self) -> None:
        """Claim n numbers for the result."""
        self.within(self["out"], self["n"])

    def operands(self, *names: str, length: np.ndarray | None = None) -> None:
        """Claim n numbers of each operand, or as many as said, or one that stands for all."""
        for name in names:
            is_splat = self.own[:, FIELDS.index("splat")] >> "abc".index(name) & 1 != 0
            self.within(self[name], np.where(is_splat, 1.0, self["n"] if length is None else length))

    def lengths(self, *fields: str, least: int = 0) -> None:
        """Claim that fields are lengths."""
        for field in fields:
            self.claim(self[field] >= least, "a length that is too small")

    def table(self, length: np.ndarray) -> None:
        """Claim numbers of the tables."""
        start = self["table"]
        self.claim((start >= 0) & (start + length < self.space.tables.size), "a table outside of the tables")

    def entry(self, place: int) -> np.ndarray:
        """The number at a place of each table."""
        return self.space.tables[self.own[:, FIELDS.index("table")] + place].astype(np.float64)

    def largest(self, start: np.ndarray, length: np.ndarray, least: int = 0) -> np.ndarray:
        """The largest number of a part of each table, -1 for an empty part.  Claims that none is below `least`."""
        is_some, tables = length > 0, self.space.tables
        low, high = np.zeros(len(self.rows)), np.full(len(self.rows), -1.0)
        if np.any(is_some):  # each part once, and in order: `reduceat` runs over what lies between them too
            parts = start[is_some].astype(np.int64) * tables.size + length[is_some].astype(np.int64)
            parts, which = np.unique(parts, return_inverse=True)
            first, number = np.divmod(parts, tables.size)
            ends = np.stack([first, first + number], 1).reshape(-1)
            low[is_some] = np.minimum.reduceat(tables, ends)[::2][which]
            high[is_some] = np.maximum.reduceat(tables, ends)[::2][which]
        self.claim(low >= least, "a place before the start of an array")
        return high

    def lines(self, number: np.ndarray, start: np.ndarray, width: int) -> "tuple[Rows, np.ndarray]":
        """The lines of a part of each table: a row for each of them, and its columns (width, rows)."""
        self.claim(np.full(len(number), np.sum(number) <= _MOST_LINES), "tables with too many lines")
        count = number.astype(np.int64)
        instruction = np.repeat(np.arange(len(count)), count)
        line = np.arange(len(instruction)) - np.repeat(np.cumsum(count) - count, count)
        places = start.astype(np.int64)[instruction] + width * line
        return Rows(self.space, self.rows[instruction]), self.space.tables[
            places[:, None] + np.arange(width)
        ].T.astype(np.float64)

    def inner(self, tape: np.ndarray) -> None:
        """Claim tapes inside of those of the instructions: they have greater numbers, so that none runs itself."""
        outer = self.space.owners[self.rows]
        self.claim((tape > outer) & (tape < self.space.num_tapes), "a tape that is not inside of its own")
        self.space.nesting.append((outer, tape.astype(np.int64)))
