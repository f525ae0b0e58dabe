"""Tapes in the store: written after their first run, and read by another process in place of a trace."""

import contextlib
import json
import struct
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import numpy as np

from . import _tuning as tuning
from ._store import store
from ._stored_results import results_from_data, results_to_data
from .tape import Tape, TapeError, read_tape, write_tape

_LENGTHS = struct.Struct("<QQ")
_TOLERANCE = 1e-12  # of a result's scale: the functions of C libraries differ in last digits


class StoredProgram(NamedTuple):
    """A tape, the structure of its results' arrays, and what of the results is static."""

    tape: Tape
    structure: Any
    static: Any


def write_program(key: str, program: StoredProgram, arguments: Any, leaves: Sequence, found: Sequence) -> None:
    """Store a tape with one question and its answer, by which another machine checks it; without a word if its
    results are no data.

    Args: arguments: of the function, with what is static; leaves: its arrays; found: the results' arrays.
    """
    probe = [np.asarray(array) for array in (*leaves, *found)]
    if sum(array.size for array in probe) > tuning.PROBE_NUMBERS:
        probe = []
    try:
        results = results_to_data(program.structure, program.static, arguments)
    except TypeError:
        return
    shapes = [(array.dtype.str, array.shape) for array in probe]
    numbers = b"".join(np.ascontiguousarray(array).tobytes() for array in probe)
    head = {"results": results, "probe": shapes, "inputs": len(leaves)}
    store().write(key, _content(head, write_tape(program.tape), numbers))


def read_program(key: str, arguments: Any) -> StoredProgram | None:
    """The tape under a key, which has answered its own question as it did where it was written; None without one."""
    content = store().read(key)
    if content is None:
        return None
    try:
        num_head, num_tape = _LENGTHS.unpack_from(content)
        start = _LENGTHS.size + num_head
        head = json.loads(content[_LENGTHS.size : start])
        tape = read_tape(code := content[start : start + num_tape])
        if head["probe"]:
            _ask(tape, head, content[start + num_tape :])
            store().write(key, _content(head | {"probe": [], "inputs": 0}, code, b""))  # asked once is enough
        return StoredProgram(tape, *results_from_data(head["results"], arguments))
    except (TapeError, ValueError, KeyError, TypeError, struct.error):
        store().remove(key)
        return None


def write_shapes(key: str, shapes: Any) -> None:
    """Store a tree of shapes and types; without a word if it is no data."""
    leaves, structure = jax.tree.flatten(shapes)
    with contextlib.suppress(TypeError):
        results = results_to_data(structure, jax.tree.map(lambda _: None, shapes), None)
        store().write(key, json.dumps([results, [(x.shape, str(x.dtype)) for x in leaves]]).encode())


def read_shapes(key: str) -> Any:
    """The tree of shapes under a key; None without one."""
    content = store().read(key)
    if content is None:
        return None
    try:
        data, leaves = json.loads(content)
        structure, _ = results_from_data(data, None)
        return jax.tree.unflatten(structure, [jax.ShapeDtypeStruct(shape, dtype) for shape, dtype in leaves])
    except (ValueError, KeyError, TypeError):
        store().remove(key)
        return None


def _content(head, tape, numbers):
    text = json.dumps(head).encode()
    return _LENGTHS.pack(len(text), len(tape)) + text + tape + numbers


def _ask(tape, head, numbers):
    """Raises: ValueError where the tape does not give the answer that it gave once."""
    arrays, place = [], 0
    for kind, shape in head["probe"]:
        dtype = np.dtype(kind)
        size = int(np.prod(shape, dtype=np.int64))
        arrays.append(np.frombuffer(numbers, dtype, size, place).reshape(shape))
        place += size * dtype.itemsize
    inputs, known = arrays[: head["inputs"]], arrays[head["inputs"] :]
    for one, other in zip(tape(*inputs), known, strict=True):
        if not _agree(*(np.asarray(x, np.result_type(x, float)) for x in (one, other))):
            raise ValueError("another answer")


def _agree(one, other):
    scale = np.max(np.abs(other), initial=0.0, where=np.isfinite(other))
    return one.shape == other.shape and np.allclose(one, other, _TOLERANCE, _TOLERANCE * scale, equal_nan=True)
