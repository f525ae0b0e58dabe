"""Decompositions of matrices, which the machine leaves to NumPy."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ._opcodes import FIELDS
from ._rows import Rows

#: Most axes of an array.
_MOST_AXES = 16


def host_results(number: int, mode: int, arrays: list[np.ndarray]) -> list[np.ndarray]:
    """Results of a decomposition of matrices (..., n, n) or (..., m, n); NaN where it does not converge."""
    function = list(HOST_FUNCTIONS.values())[number]
    try:
        return function(*arrays, mode=mode)
    except np.linalg.LinAlgError:
        return [np.array(np.nan)] * 3


def _eigh(matrix: np.ndarray, mode: int) -> list[np.ndarray]:
    if not np.all(np.isfinite(matrix)):
        return [np.array(np.nan)] * 2
    values, vectors = np.linalg.eigh((matrix + matrix.swapaxes(-1, -2)) / 2)
    return [vectors, values]


def _svd(matrix: np.ndarray, mode: int) -> list[np.ndarray]:
    """Mode: 1 with vectors, 2 with all of them."""
    if not np.all(np.isfinite(matrix)):
        return [np.array(np.nan)] * 3
    if not mode & 1:
        return [np.linalg.svd(matrix, compute_uv=False)]
    u, s, vh = np.linalg.svd(matrix, full_matrices=bool(mode & 2))
    return [s, u, vh]


#: Functions of arrays by name, in the order of their numbers in instructions.
HOST_FUNCTIONS: dict[str, Callable[..., list[np.ndarray]]] = {"eigh": _eigh, "svd": _svd}


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
    arrays = [
        arena[place : place + math.prod(shape)].reshape(shape) for place, shape in host_arrays(instruction, tables)
    ]
    operands, results = arrays[: field["x1"]], arrays[field["x1"] :]
    for result, found in zip(results, host_results(field["x0"], field["mode"], operands), strict=False):
        result[...] = found
