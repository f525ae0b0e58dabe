"""`jit`: the library's programs, run by a tape or compiled with the options that suit their kind."""

import contextlib
import functools
import gc
from collections.abc import Callable
from typing import Any, TypeVar, overload

import equinox as eqx
import jax

from ._compile_log import start_listening
from ._compiler_options import check_kind, compiler_options
from ._derivative import Differentiable, is_differentiating
from ._progress import ON_TAPE
from ._small_call import MARKING, should_mark
from ._tape_program import UNSUPPORTED, TapeFunction, tapes_work
from ._tiers import FIXED, may_run_on_tapes
from ._tracer_errors import tracer_errors_in_words
from ._tracing import closes_over_traced, evaluated_plainly, not_tracing
from ._tricks import OFF, is_on
from .tape import OvertimeError, time_limit

#: Whether what is traced now should be a small program rather than a fast one; part of the key of JAX's caches.
SMALL_PROGRAM = jax.make_user_context(False)
Function = TypeVar("Function", bound=Callable)


@overload
def jit(function: Function, *, compile: str = "auto") -> Function:
    """`function` compiled."""


@overload
def jit(function: None = None, *, compile: str = "auto") -> Callable[[Function], Function]:
    """A decorator that compiles."""


def jit(function: Callable | None = None, *, compile: str = "auto", known: Any = None) -> Callable:
    """`function` as a program, arrays traced and all else static, as `equinox.filter_jit` does it.

    Args:
        compile: "auto": run at once by a small machine of the library's, a tape, and compiled by XLA beside it once
            the tape has cost as much as compiling will; "tape": by the tape alone.  Where its operations, double
            precision or one CPU do not allow a tape, XLA compiles before the first run.  "full": compiled;
            "quick": compiled in half the time, run two to four times as long.  All but "full" are traced with fewer
            equations, see `spatial`, until they are compiled in full.

        known: what decides what the function does, for the store; None for the function itself.

    Raises: ValueError for another `compile`.

    Inside of another trace (a user's own jit or vmap) it is part of that program, and of its options.  Under a user's
    own grad or vjp, and nothing else, its value and its derivative are programs of this kind.
    """
    if function is None:
        return functools.partial(jit, compile=compile)
    check_kind(compile)

    @functools.wraps(function)
    def traced(*args, **kwargs):
        # Accelerators round the factors of single-precision products to ten bits unless they are told not to.
        with garbage_collection_paused(), jax.default_matmul_precision("highest"):
            return function(*args, **kwargs)

    inner = eqx.filter_jit(traced)

    @functools.cache
    def outer(kind, backend, off):
        return eqx.filter_jit(traced, compiler_options=compiler_options(kind, backend))

    def by_compiler(args, kwargs):
        with compile_kind(kind := {"auto": "full", "tape": "quick"}.get(compile, compile)):
            return outer(kind, jax.default_backend(), OFF.value)(*args, **kwargs)

    # `inner` is asked at the precision of traces, so that they find its own trace again
    on_tape = TapeFunction(inner, known or function, by_compiler if compile == "auto" else None)

    @functools.cache
    def differentiable():
        return Differentiable(
            compiled, inner, known or function, lambda f, known: jit(f, compile=compile, known=known)
        )

    def on_tapes():
        return may_run_on_tapes(compile) and tapes_work()

    @functools.wraps(function)
    def compiled(*args, **kwargs):
        start_listening()
        if not not_tracing():
            if on_tapes() and is_differentiating() and not closes_over_traced(function):
                return differentiable()(args, kwargs)
            return inner(*args, **kwargs)
        with evaluated_plainly():
            return run(args, kwargs)

    def run(args, kwargs):
        if on_tapes():
            found = UNSUPPORTED
            may_give_up = time_limit(compile == "auto" and FIXED == "auto")
            highest = jax.default_matmul_precision("highest")
            with contextlib.suppress(OvertimeError), compile_kind("tape"), highest, may_give_up:
                found = on_tape.call(args, kwargs)
            if found is not UNSUPPORTED:
                return found
        return by_compiler(args, kwargs)

    return compiled


@contextlib.contextmanager
def compile_kind(compile: str):
    """Trace a program that is compiled with `compiler_options`, unless it is part of one of the user's."""
    backend = jax.default_backend()
    marked = compile != "tape" and not_tracing() and should_mark(backend, compiler_options(compile, backend))
    small = compile != "full" or SMALL_PROGRAM.value
    with SMALL_PROGRAM(small), MARKING(marked), ON_TAPE(compile == "tape"), garbage_collection_paused():
        with tracer_errors_in_words(), _mesh_in_words():
            yield


def _mesh_in_words():
    """A context that says that there is no mesh of devices, as JAX does where it transposes: what is traced with the
    same context is traced once.  A user's mesh stays."""
    mesh = jax.sharding.get_abstract_mesh()
    return jax.sharding.use_abstract_mesh(mesh) if mesh.empty else contextlib.nullcontext()


@contextlib.contextmanager
def garbage_collection_paused():
    """Pause Python's garbage collector while a function is traced and lowered: of a million small objects hardly one
    is garbage, and looking for it takes a third of the time."""
    if not gc.isenabled() or not is_on("paused_gc"):
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
