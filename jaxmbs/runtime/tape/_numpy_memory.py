"""The arena as the NumPy machine sees it: views of its doubles, made once for each arena."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.lib.stride_tricks import as_strided

from ._opcodes import FIELDS

#: What an instruction does: a function, and its arguments.
Action = tuple[Callable[..., Any], tuple]


class Instruction(NamedTuple):
    """Fields of an instruction, as `_opcodes.FIELDS` lists them."""

    op: int
    mode: int
    n: int
    out: int
    a: int
    b: int
    c: int
    splat: int
    x0: int
    x1: int
    x2: int
    x3: int
    table: int


assert Instruction._fields == FIELDS


class Memory:
    """An arena of doubles and the tables of a tape, whose bounds were checked."""

    def __init__(self, doubles: np.ndarray, tables: np.ndarray):
        self.doubles, self.tables = doubles, tables.astype(np.int64)  # sums of places are longer

    def result(self, i: Instruction) -> np.ndarray:
        """The n numbers of the result."""
        return self.doubles[i.out : i.out + i.n]

    def operand(self, i: Instruction, name: str) -> np.ndarray:
        """The n numbers of an operand, or one that stands for all."""
        start = getattr(i, name)
        return self.doubles[start : start + (1 if i.splat >> "abc".index(name) & 1 else i.n)]

    def matrices(self, start: int, *shape: int) -> np.ndarray:
        """Numbers from a place on as an array."""
        return self.doubles[start : start + int(np.prod(shape))].reshape(shape)

    def rows(self, start: int, number: int, length: int, stride: int, is_splat: bool = False) -> np.ndarray:
        """Rows (number, length) at a distance, or one number for all."""
        strides = (0, 0) if is_splat else (8 * stride, 8)
        return as_strided(self.doubles[start:], (number, length), strides)

    def stack(self, start: int, shape: tuple[int, ...], strides: tuple[int, ...]) -> np.ndarray:
        """Matrices with their numbers at distances."""
        return as_strided(self.doubles[start:], shape, tuple(8 * stride for stride in strides))

    def table(self, start: int, *shape: int) -> np.ndarray:
        """Whole numbers of the tables."""
        return self.tables[start : start + int(np.prod(shape, dtype=np.int64))].reshape(shape)

    def parts(self, start: int, *lengths: int) -> list[np.ndarray]:
        """Parts of a table, one after another."""
        ends = np.cumsum([start, *lengths])
        return [self.tables[low:high] for low, high in zip(ends[:-1], ends[1:], strict=True)]


#: How an instruction of each operation becomes an action.
BINDINGS: dict[str, Callable[[Instruction, Memory], Action]] = {}


def binding(*names: str) -> Callable[[Callable], Callable]:
    """Register how instructions of some operations become actions."""

    def register(function):
        BINDINGS.update(dict.fromkeys(names, function))
        return function

    return register
