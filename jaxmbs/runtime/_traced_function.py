"""Functions of arrays that are traced once, and only if no stored program spares it."""

import contextlib
import functools
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax.extend.core import ClosedJaxpr

from ..checks import is_concrete
from ._code_content import UnknownContentError
from ._jaxpr import jaxpr_function, without_unused
from ._jit import compile_kind
from ._progress import ON_TAPE
from ._store_key import question_key
from ._stored_program import read_shapes, write_shapes
from ._tape_program import TapeFunction, TapeProgram, tapes_work
from ._tiers import may_run_on_tapes
from ._tracing import not_tracing


class TracedFunction:
    """A function of arrays as its traced equations, so that values and derivatives come from the same ones.

    A call gives the list of its results' arrays.  The trace waits until it is needed, and does not come where the
    store knows the programs that would have it in them; `shape` is known from there too.  Where a trace is under way
    it comes at once, since the function may close over numbers of that.

    Args:
        example: the arrays, or their shapes.
        compile: as of `jit`, of the programs that it will be part of.
        tape_first: trace it as tapes' programs are, so that it finds what other questions have traced of the same
            laws, and once more where it is compiled.
    """

    def __init__(self, function: Callable, *example: Any, compile: str = "auto", tape_first: bool = False):
        self._function, self._example, self._compile, self._tape_first = function, example, compile, tape_first
        self._is_inside = not not_tracing()
        self._traces: dict[bool, tuple[ClosedJaxpr, Any]] = {}
        if self._is_inside:
            self._trace(False)

    @functools.cached_property
    def shape(self) -> Any:
        """Shapes and types of the results."""
        if self._traces:
            return next(iter(self._traces.values()))[1]
        key = question_key(["shape", self], *_parted(self._example))
        found = None if key is None else read_shapes(key)
        if found is None:
            found = self._trace(True)[1]
            if key is not None:
                write_shapes(key, found)
        return found

    @property
    def jaxpr(self) -> ClosedJaxpr:
        """The equations, of the kind of program that is traced now."""
        return self._trace(ON_TAPE.value or not_tracing())[0]

    @property
    def closes_over_traced(self) -> bool:
        """True if the function closes over numbers of a trace under way."""
        return self._is_inside and not is_concrete(self.jaxpr.consts)

    def __call__(self, *arrays: Any) -> list:
        # results that are constants come as literals, which are no arrays to who parts arrays from the rest
        return [jnp.asarray(x) for x in jaxpr_function(self.jaxpr)(*arrays)]

    def on_tape(self, *arrays: Any) -> TapeProgram | None:
        """The tape of it, for arrays like these; None where it cannot be on one."""
        if not self._runs_on_tapes:
            return None
        with compile_kind("tape"):
            return self._tapes.program(tuple(jax.device_put(list(arrays))), {})[0]

    @functools.cached_property
    def _tapes(self):
        return TapeFunction(self, self)

    @property
    def _runs_on_tapes(self):
        return may_run_on_tapes(self._compile) and tapes_work()

    def _trace(self, on_tape):
        """(equations, shapes of the results); of a function of numbers under a trace there is one."""
        on_tape = on_tape and self._tape_first and self._runs_on_tapes and not self._is_inside
        if on_tape not in self._traces:
            # as if no trace were under way, unless it is one of numbers that the function has
            with contextlib.nullcontext() if self._is_inside else jax.core.eval_context():
                # the precision of `jit`, which is part of the key of JAX's traces
                with compile_kind("tape" if on_tape else self._compile), jax.default_matmul_precision("highest"):
                    traced, shape = jax.make_jaxpr(self._function, return_shape=True)(*self._example)
            self._traces[on_tape] = without_unused(traced), shape
        return self._traces[on_tape]

    def __content__(self) -> list:
        """Function, shapes and kind, for the key of programs that have it in them."""
        if self.closes_over_traced:
            raise UnknownContentError("a function of traced numbers")
        return [self._function, [(x.shape, str(x.dtype)) for x in self._example], self._compile == "full"]


def _parted(arrays):
    """Arrays, and nothing for what is static."""
    return arrays, (None,) * len(arrays)
