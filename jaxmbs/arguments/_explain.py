"""Public functions that name wrong switches, and other wrong arguments where they fail on them."""

import contextlib
import functools
import inspect
import itertools
import linecache
import re
import sys
import sysconfig
import traceback
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import jax
import numpy as np

from ..checks import flag_fault, is_flag, no_such
from ..errors import AssemblyError, ModelError, UnknownNameError
from ._faults import argument_faults
from ._quantities import in_base_units, may_have_quantities

_HERE = Path(__file__).resolve().parent.parent
_BELOW = ("site-packages", "dist-packages")
_STANDARD = Path(sysconfig.get_path("stdlib"))
_IN_WORDS = (ModelError, UnknownNameError, AssemblyError)
_RAW = (
    *(ArithmeticError, AssertionError, AttributeError, LookupError, NameError, RecursionError, TypeError, ValueError),
    np.linalg.LinAlgError,
)

#: Errors of functions that ask a traced number for its value.
_OF_TRACES = (
    jax.errors.ConcretizationTypeError,
    jax.errors.TracerArrayConversionError,
    jax.errors.TracerIntegerConversionError,
)
NEEDS_NUMBERS = (
    "needs numbers that are known before anything is compiled, and got traced ones: call it outside of jit, grad and "
    "vmap, or hand it what no trace has touched"
)

#: Calls that methods and properties are counted as if they had: fewer of theirs make up for a compiler.
_CALLED_OFTEN = 240

#: The context of each call of a public function, the last one: of its name, and of the count of its calls.
_AROUND: list[Callable[[str, Iterator[int]], contextlib.AbstractContextManager]] = []
_AROUND.append(lambda name, calls: contextlib.nullcontext())


def surround_calls(context: Callable[[str, Iterator[int]], contextlib.AbstractContextManager]) -> None:
    """Let every public function run in `context(name, calls)`, where calls counts those of that function."""
    _AROUND.append(context)


def explain_arguments(module: dict[str, Any], names: Sequence[str] = ()) -> None:
    """Let functions and classes of a module, given by its `globals()`, name arguments that they fail on.

    An error that has words of the library stays; so does any error where no argument is found wrong, and one that
    comes from a function of the user's.

    Args: names: which of them; without any, the public functions that are written in the module.
    """
    own = [
        name for name, item in module.items() if inspect.isfunction(item) and item.__module__ == module["__name__"]
    ]
    for name in names or own:
        item = module.get(name)
        if not re.match(r"jaxmbs\.(?!runtime)", getattr(item, "__module__", None) or ""):
            continue
        if inspect.isfunction(item) and not hasattr(item, "_is_explained"):
            # where it is defined, too: pickles look there
            module[name] = vars(sys.modules[item.__module__])[item.__name__] = as_public_call(item, item.__name__)
        elif inspect.isclass(item) and not issubclass(item, BaseException):
            _explain_construction(item)


def _explain_construction(kind):
    """Let a class name the arguments that it cannot be made of."""
    method = "__new__" if issubclass(kind, tuple) else "__init__"
    function = vars(kind).get(method)
    if inspect.isfunction(function) and not hasattr(function, "_is_explained"):
        setattr(kind, method, as_public_call(function, kind.__name__))
    for name, item in list(vars(kind).items()):
        if isinstance(item, classmethod) and not (name.startswith("_") or hasattr(item.__func__, "_is_explained")):
            setattr(kind, name, classmethod(as_public_call(item.__func__, f"{kind.__name__}.{name}")))
    if getattr(kind, "_computes", False):
        for base in kind.__mro__:
            if base.__module__.partition(".")[0] == _HERE.name:
                _explain_methods(base, kind.__name__)


def _explain_methods(base, owner):
    """Let public methods and properties of a class that computes, a builder or a result, be public calls too."""
    for name, item in list(vars(base).items()):
        function = item.fget if isinstance(item, property) else item
        if name.startswith("_") or not inspect.isfunction(function) or hasattr(function, "_is_explained"):
            continue
        explained = as_public_call(function, f"{owner}.{name}", _CALLED_OFTEN)
        setattr(base, name, property(explained, doc=item.__doc__) if isinstance(item, property) else explained)


def as_public_call(function: Callable, name: str, count: int = 0) -> Callable:
    """The function, whose raw errors name the arguments that are wrong.

    Args: count: calls that are taken as made already.
    """

    calls = itertools.count(count)
    kinds = {key: kind for key, kind in function.__annotations__.items() if key != "return"}
    switches = [key for key, kind in kinds.items() if kind is bool or kind == bool | None]

    @functools.wraps(function)
    def explained(*args, **options):
        if may_have_quantities():
            args, options = in_base_units(lambda: list(_parameters(function)), args, options)
        if switches:
            _check_switches(function, name, switches, args, options)
        try:
            with _AROUND[-1](name, calls):
                return function(*args, **options)
        except _RAW as error:
            if isinstance(error, _OF_TRACES) and _is_from_below(error):
                raise TypeError(f"{name} {NEEDS_NUMBERS}") from error
            if unknown := _unknown_argument(function, options, error):
                raise TypeError(f"{name}: {unknown}") from error
            faults = _is_raw(error) and argument_faults(function, args, options, error)
            if not faults:
                raise
            raise ModelError(faults, f"the call of {name}") from error

    explained._is_explained = True  # type: ignore[attr-defined]
    return explained


def _unknown_argument(function, options, error):
    """The arguments that there are, which Python's message leaves out; empty for other errors."""
    found = re.search(r"got an unexpected keyword argument '(\w+)'", str(error))
    names = [name for name in _parameters(function) if name not in ("args", "kwargs", "options")]
    if not isinstance(error, TypeError) or found is None or found[1] not in options or found[1] in names:
        return ""
    return no_such("argument", found[1], names)


def _check_switches(function, name, switches, args, options):
    """Raises: ModelError for switches that are neither true nor false, as the text "no", which counts as true."""
    given = dict(zip(_parameters(function), args, strict=False)) | options
    known = [key for key in switches if key in given and not isinstance(given[key], jax.core.Tracer)]
    open_ones = [key for key in known if given[key] is None and function.__annotations__[key] is not bool]
    faults = [flag_fault(key, given[key]) for key in known if not (is_flag(given[key]) or key in open_ones)]
    if faults:
        raise ModelError(faults, f"the call of {name}")


@functools.cache
def _parameters(function):
    return tuple(inspect.signature(function).parameters)


def _is_raw(error):
    """True for an error from below the library, or of a line of it that raises nothing itself."""
    if isinstance(error, (*_IN_WORDS, jax.errors.JAXTypeError)) or type(error).__module__.startswith("jaxtyping"):
        return False
    if not _is_from_below(error):
        return False
    last = traceback.extract_tb(error.__traceback__)[-1]
    is_own = _HERE in Path(last.filename).parents
    return not (is_own and linecache.getline(last.filename, last.lineno or 0).strip().startswith("raise"))


def _is_from_below(error):
    """True where no function of the user's stands between a public call and the error."""
    frames = traceback.extract_tb(error.__traceback__)[1:]
    return bool(frames) and all(_is_below(frame.filename) for frame in frames)


def _is_below(file):
    """True for files of the library, of what it stands on and of Python, but none of the user's."""
    path = Path(file)
    return (
        file.startswith("<") or _HERE in path.parents or _STANDARD in path.parents or bool({*_BELOW} & {*path.parts})
    )
