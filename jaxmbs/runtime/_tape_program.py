"""Functions run by tapes: traced once for each structure of their arguments, as `equinox.filter_jit` does it, and not
at all where the store knows the tape."""

import collections
import functools
import threading
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import numpy as np

from . import _tuning as tuning
from ._store_key import question_key, setting
from ._stored_program import StoredProgram, read_program, write_program
from ._tiers import Tier
from ._tricks import OFF, is_on
from .tape import Limits, Tape, TapeError, TooLargeError, UnsupportedError, is_available


class TapeProgram:
    """A tape, how its results become what the function returns, its tier, and what the compiler makes of it.

    Args:
        by_compiler: the function of (args, kwargs) compiled; None to stay on the tape.
        write: function of arrays and results, called with those of the first run.
    """

    def __init__(self, stored: StoredProgram, by_compiler: Callable | None, write: Callable | None):
        self._stored, self._by_compiler, self._write = stored, by_compiler, write
        self.tier = Tier(stored.tape.num_instructions)
        self.is_refused = False

    def __call__(self, args: tuple, kwargs: dict, leaves: list) -> Any:
        if self.tier.is_compiled and self._by_compiler is not None:
            return self._by_compiler(args, kwargs)
        arrays = jax.device_put(self.run(*leaves))
        if self._by_compiler is not None and self.tier.is_worth_compiling():
            self.tier.compile(functools.partial(self._by_compiler, args, kwargs))
        return eqx.combine(jax.tree.unflatten(self._stored.structure, arrays), self._stored.static)

    def run(self, *arrays: Any) -> list[np.ndarray]:
        """Arrays of the results, by the tape.

        Raises: UnsupportedError where these numbers are none for it; the compiler has the program from then on.
        """
        try:
            with self.tier.measured():
                found = self._stored.tape(*arrays)
        except UnsupportedError:
            self.is_refused = True
            raise
        write, self._write = self._write, None
        if write is not None:
            write(arrays, found)
        return found


def tapes_work() -> bool:
    """True where programs may run on tapes: in double precision on one CPU, with a release of JAX whose programs they
    read and nothing of its debugging on."""
    debugging = ("jax_debug_nans", "jax_debug_infs", "jax_disable_jit")
    return (
        is_on("tape")
        and is_available()
        and setting("jax_enable_x64")
        and not any(map(setting, debugging))
        and _is_one_cpu()
    )


@functools.cache
def _is_one_cpu():
    return jax.default_backend() == "cpu" and jax.device_count() == 1


class TapeFunction:
    """A function that runs on tapes; `call` returns `UNSUPPORTED` for arguments with which it cannot.

    Args:
        function: what is traced; known: the function that decides what it does, under which the store knows it.
        by_compiler: the function of (args, kwargs) compiled, for when its tape has cost as much as compiling will;
            None to stay on tapes.
    """

    def __init__(self, function: Callable, known: Callable, by_compiler: Callable | None = None):
        self._function, self._known, self._by_compiler = function, known, by_compiler
        self._programs: dict[Any, TapeProgram | None] = {}
        self._lock = threading.RLock()  # what is traced may ask a question of numbers that are known

    def call(self, args: tuple, kwargs: dict) -> Any:
        """Results of the function, arrays as JAX's; `UNSUPPORTED` if it has operations that tapes do not have."""
        program, leaves = self.program(args, kwargs)
        if program is None or program.is_refused:
            return UNSUPPORTED
        try:
            return program(args, kwargs, leaves)
        except UnsupportedError:
            return UNSUPPORTED

    def program(self, args: tuple, kwargs: dict) -> tuple[TapeProgram | None, list]:
        """The program for arguments of this structure, None if there is none, and their arrays."""
        dynamic, static = eqx.partition((args, kwargs), eqx.is_array)
        leaves, structure = jax.tree.flatten(dynamic)
        static_leaves, static_structure = jax.tree.flatten(static)
        shapes = tuple((x.shape, x.dtype, getattr(x, "weak_type", False)) for x in leaves)
        key = (structure, shapes, static_structure, tuple(static_leaves), OFF.value)
        with self._lock:
            if key not in self._programs:
                keep(self._programs, key, self._program(dynamic, static, leaves))
            return self._programs[key], leaves

    def _program(self, dynamic, static, leaves):
        """The program that another function of the same content has, the store's, or a new one."""
        key = question_key(self._known, dynamic, static)
        if key is None:
            return self._new(self._trace(dynamic, static, leaves))
        if key not in _PROGRAMS:
            arguments, write = eqx.combine(dynamic, static), None
            stored = read_program(key, arguments)
            if stored is None and (stored := self._trace(dynamic, static, leaves)) is not None:
                write = functools.partial(write_program, key, stored, arguments)
            keep(_PROGRAMS, key, self._new(stored, write))
        return _PROGRAMS[key]

    def _new(self, stored, write=None):
        return None if stored is None else TapeProgram(stored, self._by_compiler, write)

    def _trace(self, dynamic, static, leaves):
        structure, found = jax.tree.structure(dynamic), []

        def flat(*leaves):
            args, kwargs = eqx.combine(jax.tree.unflatten(structure, leaves), static)
            results, fixed = eqx.partition(self._function(*args, **kwargs), eqx.is_array)
            found[:] = jax.tree.structure(results), fixed
            return jax.tree.leaves(results)

        traced = jax.make_jaxpr(flat)(*leaves)
        try:
            tape = Tape(traced, Limits(tuning.TAPE_DOUBLES, tuning.TAPE_WORK))
        except TooLargeError:
            return None
        except (UnsupportedError, TapeError) as error:  # also where a tape of ours would not hold its own checks
            UNSUPPORTED_OPERATIONS[str(error)] += 1
            return None
        return StoredProgram(tape, *found)


def keep(programs: dict, key: Any, program: Any) -> None:
    """Add a program to those at hand; the oldest go."""
    while len(programs) >= tuning.TAPES_KEPT:
        programs.pop(next(iter(programs)), None)
    programs[key] = program


UNSUPPORTED = object()
#: What kept programs of this process from running on tapes, and how many.
UNSUPPORTED_OPERATIONS: collections.Counter[str] = collections.Counter()
#: Programs of this process by the content of their questions.
_PROGRAMS: dict[str, TapeProgram | None] = {}
