"""`jit`: the library's programs compiled with the options that suit their kind."""

import contextlib
import functools
import gc
import os
from collections.abc import Callable
from typing import TypeVar, overload

import equinox as eqx
import jax

from ._compile_log import listen
from ._small_call import MARKED, marks
from ._tracing import not_tracing

#: What XLA's CPU compiler is told.  Its emitters of fused loops and its higher levels take half of the time of
#: compilation, and gain a tenth in trees and nothing in loops; 32 parts of a program are too many.  Sums that go to
#: its library of kernels keep the loop around them from being one kernel.  Without optimisation a program compiles in
#: half the time and runs slower.  What runs for hundreds of designs and is no motion gains by the
#: highest level: a tree's gradient is 1.4 times as fast, for a fifth more to compile.
_FULL = {
    "xla_cpu_use_fusion_emitters": False,
    "xla_cpu_experimental_ynn_fusion_type": "",
    "xla_cpu_parallel_codegen_split_count": 8,
    "xla_backend_optimization_level": 1,
}
_QUICK = {**_FULL, "xla_backend_optimization_level": 0}
_OFTEN = {**_FULL, "xla_backend_optimization_level": 3}
#: Whether what is traced now should be a small program rather than a fast one; part of the key of JAX's caches.
SMALL = jax.make_user_context(False)
Function = TypeVar("Function", bound=Callable)


@overload
def jit(function: Function, *, compile: str = "full") -> Function:
    """`function` compiled."""


@overload
def jit(function: None = None, *, compile: str = "full") -> Callable[[Function], Function]:
    """A decorator that compiles."""


def jit(function: Callable | None = None, *, compile: str = "full") -> Callable:
    """`function` compiled, arrays traced and all else static, as `equinox.filter_jit` does it.

    Args:
        compile: "full", or "quick" for programs that run a few times: compiled in half the time, run two to
            four times as long.  They are also traced with fewer equations, see `spatial`.

    Raises: ValueError for another `compile`.

    Inside of another trace (a user's own jit, grad or vmap) it is part of that program, and of its options.
    """
    if function is None:
        return functools.partial(jit, compile=compile)
    _check_kind(compile)

    @functools.wraps(function)
    def traced(*args, **kwargs):
        with collector_at_rest():
            return function(*args, **kwargs)

    inner = eqx.filter_jit(traced)

    @functools.cache
    def outer(backend):
        return eqx.filter_jit(traced, compiler_options=options(compile, backend))

    @functools.wraps(function)
    def compiled(*args, **kwargs):
        listen()
        if not not_tracing():
            return inner(*args, **kwargs)
        with of_kind(compile):
            return outer(jax.default_backend())(*args, **kwargs)

    return compiled


@contextlib.contextmanager
def of_kind(compile: str):
    """What is traced now is a program compiled with `options`, unless it is part of one of the user's."""
    backend = jax.default_backend()
    marked = not_tracing() and marks(backend, options(compile, backend))
    with SMALL(compile == "quick" or SMALL.value), MARKED(marked), collector_at_rest():
        yield


@contextlib.contextmanager
def collector_at_rest():
    """Python's collector paused while a function is traced and lowered: of a million small objects hardly one is
    garbage, and looking for it takes a third of the time."""
    if not gc.isenabled():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


@functools.cache
def options(compile: str, backend: str, often: bool = False) -> dict:
    """The compiler's options for programs of a kind, but those that this version of JAX does not know, and those that
    the user sets in XLA_FLAGS.

    Args: often: whether a full program, no motion, is to run for hundreds of designs.

    Raises: ValueError for another `compile`.
    """
    _check_kind(compile)
    wanted = _QUICK if compile == "quick" else _OFTEN if often else _FULL
    given = os.environ.get("XLA_FLAGS", "")
    return {name: value for name, value in wanted.items() if name in _known(backend) and f"--{name}" not in given}


def _check_kind(compile):
    if compile not in ("full", "quick"):
        raise ValueError(f"compile must be 'full' or 'quick', got {compile!r}")


@functools.cache
def _known(backend):
    """Names of the options that the compiler takes."""
    if backend != "cpu":
        return ()
    return tuple(_QUICK) if _takes(_QUICK) else tuple(name for name in _QUICK if _takes({name: _QUICK[name]}))


def _takes(some):
    try:
        jax.jit(lambda x: x, compiler_options=some).lower(0.0).compile()
    except jax.errors.JaxRuntimeError:
        return False
    return True
