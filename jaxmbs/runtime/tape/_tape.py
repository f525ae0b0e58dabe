"""A tape: a traced program as instructions of the machine, run without compiling anything."""

import threading
from typing import Any

import numpy as np
from jax.extend.core import ClosedJaxpr

from . import _control, _elementwise, _index, _linalg, _rearrange, _reduce  # noqa: F401  (they register rules)
from ._flatten import Atom
from ._host import host_results
from ._machine import run
from ._memory import Value
from ._opcodes import FIELDS
from ._writer import Writer

#: Doubles of an arena that is kept between calls; a larger one is made anew each time.
_KEPT_ARENA = 200_000


class Tape:
    """A traced program of arrays of doubles, whole numbers and truth values, ready to run.

    Several threads may call it at once: each call has an arena of its own.  Raises: UnsupportedError for a program
    with an operation or a type of number that tapes do not have.
    """

    def __init__(self, program: ClosedJaxpr):
        writer = Writer()
        shapes = [Atom(variable.aval) for variable in program.jaxpr.invars]
        inputs = []
        for shape in shapes:
            buffer = writer.arena.buffer(shape.size, is_lasting=True)
            inputs.append(Value(buffer, buffer.place, shape.size == 1))
        outputs, results = writer.body(program, inputs, shapes)
        self._inputs = [(value.place, shape) for value, shape in zip(inputs, shapes, strict=True)]
        self._outputs = [(v.place, v.is_splat, atom) for v, atom in zip(outputs, results, strict=True)]
        self._code = np.array([row for tape in writer.tapes for row in tape], np.int64).reshape(-1, len(FIELDS))
        self._starts = np.cumsum([0, *map(len, writer.tapes)])
        self._tables, self._host_calls = writer.arena.all_tables(), writer.host_calls
        self._size, self._constants, self._largest_work = (
            writer.arena.size,
            writer.arena.constants,
            writer.largest_work,
        )
        self._arenas: list[np.ndarray] = []
        self._lock = threading.Lock()

    @property
    def num_instructions(self) -> int:
        """Number of instructions, each written once."""
        return len(self._code)

    @property
    def num_doubles(self) -> int:
        """Size of the arena."""
        return self._size

    @property
    def largest_work(self) -> int:
        """Multiplications of the largest product or factor of matrices."""
        return self._largest_work

    def __call__(self, *arrays: Any) -> list[np.ndarray]:
        """Results of the program, arrays of NumPy with the types of the program's results."""
        arena = self._take_arena()
        for (place, shape), array in zip(self._inputs, arrays, strict=True):
            arena[place : place + shape.size] = np.asarray(array).reshape(-1)
        run(self._code, self._starts, self._tables, arena, lambda number: self._call_host(arena, number))
        found = [self._result(arena, *output) for output in self._outputs]
        if self._size <= _KEPT_ARENA:
            with self._lock:
                self._arenas.append(arena)
        return found

    def _take_arena(self):
        """An arena that no other call uses.  Constants are never overwritten, so that one may be used again."""
        with self._lock:
            if self._arenas:
                return self._arenas.pop()
        arena = np.zeros(self._size)
        for place, numbers in self._constants:
            arena[place : place + numbers.size] = numbers
        return arena

    @staticmethod
    def _result(arena, place, is_splat, atom):
        numbers = np.full(atom.size, arena[place]) if is_splat else arena[place : place + atom.size]
        return numbers.reshape(atom.shape).astype(atom.dtype)

    def _call_host(self, arena, number):
        name, params, (operands, results) = self._host_calls[number]
        arrays = [arena[place : place + int(np.prod(shape))].reshape(shape) for place, shape in operands]
        for (place, shape), found in zip(results, host_results(name, params, arrays), strict=False):
            arena[place : place + int(np.prod(shape))] = np.broadcast_to(found, shape).reshape(-1)
