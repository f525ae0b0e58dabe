"""Instructions that the machine leaves to NumPy and SciPy: their arrays, their checks and their calls."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ._host_functions import HOST_FUNCTIONS
from ._opcodes import FIELDS
from ._rows import Rows

#: Functions that take finite numbers alone; of others their results are not numbers.
_OF_FINITE = ("eigh", "svd", "eig", "schur", "cholesky")
#: Most axes of an array.
_MOST_AXES = 16


def host_table(arrays: Sequence[tuple[int, Sequence[int]]]) -> list[int]:
    """Table of the arrays of an instruction: place, number of axes, their lengths."""
    return [number for place, shape in arrays for number in (place, len(shape), *shape)]


def host_arrays(instruction: np.ndarray, tables: np.ndarray) -> list[tuple[int, tuple[int, ...]]]:
    """Place and shape of the operands and results of an instruction.  Raises: ValueError for a table that is none."""
    field = dict(zip(FIELDS, map(int, instruction), strict=True))
    at, found = field["table"], []
    for _ in range(field["x1"] + field["x2"]):
        if not 0 <= at <= len(tables) - 2:
            raise ValueError
        place, axes = map(int, tables[at : at + 2])
        shape = tuple(map(int, tables[at + 2 : at + 2 + axes])) if 0 <= axes <= _MOST_AXES else ()
        if len(shape) != axes or min(shape, default=0) < 0:
            raise ValueError
        found.append((place, shape))
        at += 2 + axes
    return found


def check_host(rows: Rows) -> None:
    """Claim known functions, and arrays within the arena."""
    rows.claim((rows["x0"] >= 0) & (rows["x0"] < len(HOST_FUNCTIONS)), "a function that does not exist")
    rows.lengths("x1", "x2")
    for k, instruction in enumerate(rows.own):
        only = np.arange(len(rows.rows)) != k
        try:
            arrays = host_arrays(instruction, rows.space.tables)
        except ValueError:
            rows.claim(only, "a table that lists no arrays")
        for place, shape in arrays:
            rows.claim(only | rows.has(place, math.prod(shape)), "numbers outside of the arena")


def call_host(instruction: np.ndarray, tables: np.ndarray, arena: np.ndarray) -> None:
    """Run a host instruction over an arena."""
    field: dict[str, Any] = dict(zip(FIELDS, map(int, instruction), strict=True))
    places = host_arrays(instruction, tables)
    arrays = [arena[place : place + math.prod(shape)].reshape(shape) for place, shape in places]
    operands, results = arrays[: field["x1"]], arrays[field["x1"] :]
    _write(list(HOST_FUNCTIONS)[field["x0"]], field["mode"], _joined(operands, field["x3"]), results)


def _joined(arrays, pairs):
    """Operands; two arrays are the parts of a complex one where the bit of the operand is set."""
    found, rest = [], iter(arrays)
    for real in rest:
        found.append(real + 1j * next(rest) if pairs >> len(found) & 1 else real)
    return found


def _write(name, mode, operands, results):
    """Write the results of a function, NaN where there are none: one by one where some matrices are not finite."""
    matrix = _part_in_use(name, mode, operands[0])
    if name in _OF_FINITE and not np.all(np.isfinite(matrix)):
        return _one_by_one(name, mode, operands, results)
    try:
        found = HOST_FUNCTIONS[name](mode, *operands)
    except np.linalg.LinAlgError:
        return _one_by_one(name, mode, operands, results)
    parts = [part for x in found for part in ((x.real, x.imag) if np.iscomplexobj(x) else (x,))]
    for result, part in zip(results, parts, strict=True):
        result[...] = part
    return None


def _part_in_use(name, mode, matrix):
    """The triangle of a matrix that a function reads; what stands beside it does not matter."""
    if name == "cholesky" or name == "eigh" and mode & 1:
        return np.tril(matrix)
    return np.triu(matrix) if name == "eigh" else matrix


def _one_by_one(name, mode, operands, results):
    """Results of each matrix, NaN for those that have none."""
    lead = operands[0].shape[:-2]
    for place in np.ndindex(lead) if lead else ():
        _write(name, mode, [x[place] for x in operands], [result[place] for result in results])
    for result in results if not lead else ():
        result[...] = np.nan
