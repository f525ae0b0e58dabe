"""Validation of a tape before it runs: a damaged or hostile one is refused."""

from collections.abc import Iterable

import numpy as np

from ._checks import CHECKS
from ._opcodes import FIELDS, OPERANDS, WHOLE
from ._rows import Rows, Space, TapeError

#: Most tapes inside of each other: each takes some hundred bytes of the stack of its thread.
_DEEPEST = 200
_KINDS = sorted(set(OPERANDS))
_KIND = np.array([_KINDS.index(operands) for operands in OPERANDS])


def validate(
    code: np.ndarray, starts: np.ndarray, tables: np.ndarray, size: int, places: Iterable[tuple[int, int]]
) -> None:
    """Check that a tape reads and writes within its arena and its tables, and ends unless it loops.

    Args:
        code: (instructions, fields); starts: of each tape in it, and the end of the last one;
            tables: and a number after them.
        size: number of doubles of the arena.
        places: start and length of each input, result and constant in it.

    Raises: TapeError, which names the first instruction that is wrong.
    """
    for name, array in (("instructions", code), ("starts", starts), ("tables", tables)):
        if array.dtype != WHOLE or not array.flags.c_contiguous:
            raise TapeError(f"the {name} of the tape are not whole numbers of 32 bits in a row")
    if code.ndim != 2 or code.shape[1] != len(FIELDS):
        raise TapeError("the instructions of the tape have not the fields of the machine's")
    if len(starts) < 2 or starts[0] != 0 or starts[-1] != len(code) or np.any(np.diff(starts) < 0):
        raise TapeError("the tapes inside of the tape do not lie one after another")
    if not tables.size:
        raise TapeError("the tables of the tape have no number after them")
    start, length = np.array([*places, (0, 0)], np.float64).T
    if np.any((start < 0) | (length < 0) | (start + length > size)):
        raise TapeError("an input, result or constant lies outside of the arena")
    if np.any((code[:, 0] < 0) | (code[:, 0] >= len(OPERANDS))):
        raise TapeError("the tape has an operation that the machine does not have")
    owners = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    space = Space(code, owners, tables, len(starts) - 1, size, [])
    kinds = _KIND[code[:, 0]]
    for number in np.unique(kinds):
        CHECKS[_KINDS[number]](Rows(space, np.flatnonzero(kinds == number)))
    _check_depth(space)


def _check_depth(space):
    depth = np.zeros(space.num_tapes, np.int64)
    pairs = {(int(outer), int(inner)) for pair in space.nesting for outer, inner in zip(*pair, strict=True)}
    for outer, inner in sorted(pairs):  # an inner tape has the greater number, so that its outer ones are done before
        depth[inner] = max(depth[inner], depth[outer] + 1)
    if np.max(depth) > _DEEPEST:
        raise TapeError(f"{np.max(depth)} tapes of the tape are inside of each other, more than {_DEEPEST}")
