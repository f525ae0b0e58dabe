"""`mbs.jit`: functions of the user compiled with the options of the library's programs."""

import functools
from collections.abc import Callable
from typing import Any

import jax

from ._code_content import UnknownContentError
from ._compiler_options import check_kind
from ._content import content_of
from ._jit import jit as library_jit
from ._question import name_of, question
from ._tape_program import keep
from ._tracing import as_array, not_tracing

_PROGRAMS: dict = {}  # of functions by their content


def jit(function: Callable | None = None, *, compile: str = "auto") -> Any:
    """Compile a function: arrays and floats are traced, so that another number compiles nothing anew; all else
    (names, whole numbers, functions) is static.

    Args:
        function: None makes a decorator.
        compile: "auto": a small machine of the library's runs the function at once, without a compiler, and XLA
            compiles it beside once that has cost as much as compiling will; a swap comes between two calls, and
            changes results by rounding.  "tape": by the machine alone, a few times slower than compiled.  Both in
            double precision on one CPU; elsewhere, and where the function calls back to Python, XLA compiles first.
            "full": compiled; "quick": compiled in half the time, run two to four times as long.

    Raises: ValueError for another `compile`.
    """
    if function is None:
        return functools.partial(jit, compile=compile)
    check_kind(compile)
    name, own = name_of(function), []

    @functools.wraps(function)
    def compiled(*args: Any, **kwargs: Any) -> Any:
        if not own:  # what the function reads counts as it is at the first call
            own.append(_program_of(function, compile))
        args, kwargs = jax.tree.map(_as_traced, (args, kwargs))
        with question(name):
            return own[0](*args, **kwargs)

    return compiled


def _program_of(function, compile):
    """The program of a function, that of an earlier one of the same content: a cell of a notebook that runs again
    defines its functions again, and compiles nothing."""
    try:
        key = (content_of(function), compile) if not_tracing() else None
    except UnknownContentError:
        key = None
    if key is None:
        return library_jit(function, compile=compile)
    keep(_PROGRAMS, key, _PROGRAMS.pop(key, None) or library_jit(function, compile=compile))  # the last used is last
    return _PROGRAMS[key]


def _as_traced(x):
    """Floats as arrays, which are traced."""
    return as_array(x, None) if type(x) in (float, complex) else x
