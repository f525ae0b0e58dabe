"""Functions run by tapes: traced once for each structure of their arguments, as `equinox.filter_jit` does it."""

import collections
import threading
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax

from . import _tuning as tuning
from ._tiers import Tier
from ._tricks import OFF, is_on
from .tape import Tape, UnsupportedError, is_available


class _Program:
    """A tape, and how its results become what the function returns; its tier."""

    def __init__(self, tape: Tape, structure: Any, static: Any):
        self._tape, self._structure, self._static = tape, structure, static
        self.tier = Tier(tape.num_instructions)

    def __call__(self, leaves):
        with self.tier.measured():
            found = jax.device_put(self._tape(*leaves))
        return eqx.combine(jax.tree.unflatten(self._structure, found), self._static)


def tapes_work() -> bool:
    """True where programs may run on tapes: in double precision on one CPU, with nothing of JAX's debugging on."""
    values = jax.config.values
    return (
        is_on("tape")
        and is_available()
        and values["jax_enable_x64"]
        and not any(values[name] for name in ("jax_debug_nans", "jax_debug_infs", "jax_disable_jit"))
        and jax.default_backend() == "cpu"
        and jax.device_count() == 1
    )


class TapeFunction:
    """A function that runs on tapes; `call` returns `UNSUPPORTED` for arguments with which it cannot, or from when on
    the compiler's program is there.

    Args: by_compiler: the function of (args, kwargs) compiled; None to stay on tapes.
    """

    def __init__(self, function: Callable, by_compiler: Callable | None = None):
        self._function, self._by_compiler = function, by_compiler
        self._programs: dict[Any, _Program | None] = {}
        self._lock = threading.RLock()  # what is traced may ask a question of numbers that are known

    def call(self, args: tuple, kwargs: dict) -> Any:
        """Results of the function, arrays as JAX's; `UNSUPPORTED` if it has operations that tapes do not have."""
        dynamic, static = eqx.partition((args, kwargs), eqx.is_array)
        leaves, structure = jax.tree.flatten(dynamic)
        static_leaves, static_structure = jax.tree.flatten(static)
        shapes = tuple((x.shape, x.dtype, getattr(x, "weak_type", False)) for x in leaves)
        key = (structure, shapes, static_structure, tuple(static_leaves), OFF.value)
        with self._lock:
            if key not in self._programs:
                while len(self._programs) >= tuning.TAPES_KEPT:
                    self._programs.pop(next(iter(self._programs)))
                self._programs[key] = self._trace(leaves, structure, static)
            program = self._programs[key]
        if program is None or program.tier.is_compiled:
            return UNSUPPORTED
        found = program(leaves)
        if self._by_compiler is not None and program.tier.is_worth_compiling():
            program.tier.compile(self._by_compiler, args, kwargs)
        return found

    def _trace(self, leaves, structure, static):
        found = []

        def flat(*leaves):
            args, kwargs = eqx.combine(jax.tree.unflatten(structure, leaves), static)
            dynamic, fixed = eqx.partition(self._function(*args, **kwargs), eqx.is_array)
            found[:] = jax.tree.structure(dynamic), fixed
            return jax.tree.leaves(dynamic)

        traced = jax.make_jaxpr(flat)(*leaves)
        try:
            tape = Tape(traced)
        except UnsupportedError as error:
            UNSUPPORTED_OPERATIONS[str(error)] += 1
            return None
        is_small = tape.num_doubles <= tuning.TAPE_DOUBLES and tape.largest_work <= tuning.TAPE_WORK
        return _Program(tape, *found) if is_small else None


UNSUPPORTED = object()
#: What kept programs of this process from running on tapes, and how many.
UNSUPPORTED_OPERATIONS: collections.Counter[str] = collections.Counter()
