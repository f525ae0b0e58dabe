"""A tape: a traced program as instructions of the machine, run without compiling anything."""

import contextlib
import contextvars
from collections.abc import Callable
from typing import Any

import numpy as np
from jax.extend.core import ClosedJaxpr

from .. import _tuning as tuning
from ._flatten import LONG_INTEGERS, Limits, UnsupportedError, has_long_integers
from ._machine import bind
from ._overtime import LIMITED, OvertimeError
from ._parts import Parts, by_array

#: Name, by `jax.ad_checkpoint.checkpoint_name`, of numbers that may be looked at while a tape runs.
SHOWN = "jaxmbs shown"
#: Called with a view of the numbers that a tape shows while it runs, before it does.
WATCH: contextvars.ContextVar[Callable[[np.ndarray], None] | None] = contextvars.ContextVar("watch", default=None)


class Tape:
    """A traced program of arrays of doubles, complex ones, whole numbers and truth values, ready to run.

    Several threads may call it at once: each call has an arena of its own.

    Args: program: what it runs, or the parts of a tape of it; limits: of a program.

    Raises: UnsupportedError for a program with an operation or a type of number that tapes do not have, TooLargeError
    beyond the limits, TapeError for parts that would read or write outside of the arena.
    """

    def __init__(self, program: ClosedJaxpr | Parts, limits: Limits | None = None):
        if not isinstance(program, Parts):
            from ._written import written  # the rules of all primitives, which stored tapes do not need

            program = written(program, limits or Limits())
        self.parts = program.validated()
        self._inputs, self._outputs = by_array(program.inputs), by_array(program.outputs)
        self._is_slow = False
        self._arenas: list[tuple[np.ndarray, Callable[[], None]]] = []

    @property
    def num_instructions(self) -> int:
        """Number of instructions, each written once."""
        return len(self.parts.code)

    @property
    def num_doubles(self) -> int:
        """Size of the arena."""
        return self.parts.size

    def __call__(self, *arrays: Any) -> list[np.ndarray]:
        """Results of the program, arrays of NumPy with the types of the program's results.

        Raises: OvertimeError where runs have a `time_limit`, when it has cost more than compiling; UnsupportedError
        for whole numbers beyond 2^53, which its doubles do not have.
        """
        arrays = tuple(map(np.asarray, arrays))
        if any(has_long_integers(array, array.dtype) for array in arrays):
            raise UnsupportedError(LONG_INTEGERS)
        arena, run = taken = self._take_arena()
        for places, array in zip(self._inputs, arrays, strict=True):
            for place, numbers in zip(
                places, (array,) if len(places) == 1 else (array.real, array.imag), strict=True
            ):
                arena[place.start : place.start + place.size] = numbers.reshape(-1)
        if watch := WATCH.get():
            for place in self.parts.shown:
                watch(arena[place.start : place.start + place.size])
        self._run(run)
        found = [_result(arena, places) for places in self._outputs]
        if self.parts.size <= tuning.TAPE_ARENA_KEPT:
            self._arenas.append(taken)
        return found

    def _run(self, run):
        """Run the tape; one that was too slow once is not begun again where it may be given up."""
        if self._is_slow and LIMITED.get():
            raise OvertimeError
        try:
            run()
        except OvertimeError:
            self._is_slow = True
            raise

    def _take_arena(self):
        """An arena that no other call uses, and what runs the tape over it.

        Constants are never overwritten, so that one may be used again.  There is no lock, which a process forked
        meanwhile would find locked: Python takes from a list at once.
        """
        with contextlib.suppress(IndexError):
            return self._arenas.pop()
        arena = np.zeros(self.parts.size)
        for place, numbers in self.parts.constants:
            arena[place : place + numbers.size] = numbers
        return arena, bind(self.parts, arena)


def _result(arena, places):
    if len(places) == 2:
        found = np.empty(places[0].shape, np.complex128)
        found.real, found.imag = (_numbers(arena, place) for place in places)
        return found
    numbers, dtype = _numbers(arena, places[0]), places[0].dtype
    if dtype == np.int64 and np.any(is_largest := numbers >= 2.0**63):  # as the machine has the largest one
        return np.where(is_largest, np.iinfo(dtype).max, np.where(is_largest, 0.0, numbers).astype(dtype))
    return numbers.astype(dtype)


def _numbers(arena, place):
    start, size = place.start, place.size
    numbers = np.full(size, arena[start]) if place.is_splat else arena[start : start + size]
    return numbers.reshape(place.shape)
