"""Single operations outside of any program, run by the tape's machine in place of a compiler for each of them.

What a verb does before and after its programs, in single operations of JAX, would be compiled by XLA one by one, some
twenty milliseconds each.  `eager_on_tapes` lets them run at once, as if they were evaluated plainly.
"""

import contextlib
import functools
from collections.abc import Callable, Iterator
from typing import Any

import jax
import jax.core
import numpy as np
from jax.extend.core import set_current_trace

from . import _tuning as tuning
from ._store_key import setting
from ._tape_program import keep, tapes_work
from ._tiers import FIXED
from ._tracing import OUTSIDE, add_outside, current_trace_state
from .tape import Limits, Tape, UnsupportedError

_TAPES: dict[Any, Tape | None] = {}
_MORE = frozenset("while scan custom_linear_solve linear_solve".split())  # loops: what they cost is not known


def eager_on_tapes(calls: Iterator[int]) -> contextlib.AbstractContextManager:
    """A context in which single operations run on tapes, where no trace is under way and programs may do so.

    Args: calls: counts those of a function, which after many of them is left to the compiler.
    """
    if next(calls) > tuning.EAGER_CALLS:
        return contextlib.nullcontext()
    if FIXED == "full" or current_trace_state() != OUTSIDE or not tapes_work():
        return contextlib.nullcontext()
    return set_current_trace(_trace())


@functools.cache
def _trace() -> Any:
    trace = _TapeTrace()
    with set_current_trace(trace):
        add_outside(current_trace_state())
    return trace


class _TapeTrace(jax.core.Trace):
    """Evaluates each operation; those that tapes do not have by XLA."""

    def stage_value(self, val: Any) -> Any:
        return val if isinstance(val, jax.Array) else jax.device_put(val)

    def process_primitive(self, primitive: Any, args: Any, params: Any, /) -> Any:
        key = _key(primitive, args, params)
        if key is not None and key not in _TAPES:
            keep(_TAPES, key, _tape(primitive, args, params))
        tape = None if key is None else _TAPES[key]
        if tape is None:
            with jax.core.eval_context():  # JAX 0.12 leaves no trace while one has an operation
                return primitive.bind(*args, **params)
        found = jax.device_put(tape(*args))
        return found if primitive.multiple_results else found[0]

    def process_call(self, call_primitive: Any, f: Any, tracers: Any, params: Any, /) -> Any:
        return self._called(f, tracers)

    def process_custom_jvp_call(self, primitive: Any, fun: Any, jvp: Any, tracers: Any, /, **_: Any) -> Any:
        return self._called(fun, tracers)

    def process_custom_vjp_call(self, primitive: Any, fun: Any, fwd: Any, bwd: Any, tracers: Any, /, **_: Any) -> Any:
        return self._called(fun, tracers)

    def _called(self, function, args):
        with set_current_trace(self):
            return function.call_wrapped(*args)


def _key(primitive, args, params):
    """Operation, shapes and parameters as a key; None for one that goes to XLA."""
    try:
        shapes = tuple((x.shape, x.dtype, x.weak_type) for x in map(jax.typeof, args))  # numbers of Python are weak
        key = (primitive, shapes, tuple(sorted(params.items())), setting("jax_default_matmul_precision"))
        hash(key)
    except (AttributeError, TypeError):
        return None
    return None if any(np.prod(shape) > tuning.EAGER_NUMBERS for shape, *_ in shapes) else key


def _tape(primitive, args, params):
    if primitive.name in _MORE:
        return None
    function: Callable = lambda *xs: primitive.bind(*xs, **params)
    shapes = [jax.ShapeDtypeStruct(x.shape, x.dtype, weak_type=x.weak_type) for x in map(jax.typeof, args)]
    traced = jax.make_jaxpr(function)(*shapes)
    if any(aval.weak_type for aval in traced.out_avals) or traced.effects:
        return None
    try:
        tape = Tape(traced, Limits(8 * tuning.EAGER_NUMBERS, tuning.EAGER_NUMBERS))
    except UnsupportedError:
        return None
    return tape if tape.num_instructions <= tuning.EAGER_INSTRUCTIONS else None
