"""Functions and settings known by what they hold: code, constants, what they close over, and globals they read."""

import dataclasses
import enum
import functools
import hashlib
import re
import sys
import types
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import equinox as eqx
import jax
import numpy as np

from ..checks import is_concrete

_LIBRARIES = ("jax", "jaxlib", "jaxmbs", "numpy", "scipy", "equinox", "diffrax", "optax", "lineax", "optimistix")
_NUMBERS = (bool, int, float, complex, str, bytes, type(None), type(...), range, slice)


class UnknownContentError(Exception):
    """Something whose behaviour cannot be read off."""


class KnownFunction:
    """A function that equals others with the same content, so that a program compiled for one serves them all.

    A function whose content cannot be read off (it reads objects that may change) equals itself alone.
    """

    def __init__(self, function: Callable):
        functools.update_wrapper(self, function, updated=())
        self.function = function
        try:
            self._content: Any = content_of(function)
            self.is_known = True
        except UnknownContentError:
            self._content, self.is_known = function, False

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        return self.function(*args, **kwargs)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, KnownFunction) and self._content == other._content

    def __hash__(self) -> int:
        return hash(self._content)

    def __repr__(self) -> str:
        return repr(self.function)


def as_argument(function: Callable, *args: Any) -> Callable:
    """A function of the user's as an argument of a program, which serves all functions of the same content.

    One whose content cannot be read off is traced at every call, so that what it reads then counts; arrays that it
    closes over, traced ones too, become arguments.

    Args: args: what it takes.
    """
    known = KnownFunction(function)
    return known if known.is_known else eqx.filter_closure_convert(function, *args)


def content_of(value: Any, strict: bool = True) -> str:
    """A name for the content of functions, settings or the structure of a pytree, the same in every process that runs
    the same version of Python.

    Args: strict: whether an object of an unknown kind is an error; else it counts by its text, without addresses.

    Raises: NoContent.
    """
    found = hashlib.sha256()
    for token in _Reader(strict).tokens(value):
        found.update(token.encode() + b"\n")
    return found.hexdigest()


class _Reader:
    def __init__(self, strict: bool):
        self._strict, self._open = strict, set()

    def tokens(self, value: Any) -> Iterator[str]:
        """Contents of a value, in order."""
        if isinstance(value, _NUMBERS) and not isinstance(value, enum.Enum):
            yield f"{type(value).__name__} {value!r}"
        elif isinstance(value, np.ndarray | np.generic | jax.Array):
            yield self._array(value)
        elif id(value) in self._open:
            yield "itself"
        else:
            self._open.add(id(value))
            yield f"{type(value).__module__}.{type(value).__qualname__}"
            for part in self._parts(value):
                yield from self.tokens(part)
            self._open.discard(id(value))
            yield "end"

    def _array(self, value):
        if not is_concrete(value):
            raise UnknownContentError("a traced array")
        array = np.asarray(value)
        if array.dtype.hasobject:
            raise UnknownContentError("an array of objects")
        return f"{array.dtype}{array.shape} {hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()}"

    def _parts(self, value) -> list:
        """Parts of an object."""
        if isinstance(value, types.FunctionType):
            return self._function(value)
        if isinstance(value, types.CodeType):
            names = value.co_names, value.co_varnames, value.co_argcount, value.co_kwonlyargcount, value.co_flags
            return [value.co_code, *names, *value.co_consts]
        if isinstance(value, type):
            return self._class(value)
        if isinstance(value, types.ModuleType | types.BuiltinFunctionType | np.ufunc):
            return [str(getattr(value, "__module__", "")), getattr(value, "__qualname__", value.__name__)]
        if isinstance(value, types.MethodType):
            return [value.__self__, value.__func__]
        if isinstance(value, functools.partial):
            return [value.func, value.args, value.keywords]
        if isinstance(value, KnownFunction):
            return [value.function]
        if isinstance(value, jax.tree_util.PyTreeDef):
            return [value.node_data(), *value.children()]
        if isinstance(value, Mapping):
            return [part for item in value.items() for part in item]
        if isinstance(value, tuple | list):
            return list(value)
        if isinstance(value, set | frozenset):
            return sorted(content_of(part, self._strict) for part in value)
        if isinstance(value, enum.Enum):
            return [value.name]
        if dataclasses.is_dataclass(value):
            fields = (part for f in dataclasses.fields(value) for part in (f.name, getattr(value, f.name, None)))
            return [type(value), *fields]
        if callable(getattr(value, "__wrapped__", None)):  # of jax.jit, and of rules for derivatives
            return [value.__wrapped__, *(getattr(value, rule, None) for rule in ("jvp", "fwd", "bwd"))]
        if self._strict:
            raise UnknownContentError(f"{value!r}")
        return [re.sub(r" at 0x[0-9a-f]+", "", repr(value))]

    def _class(self, kind) -> list:
        """Its name; of a user's class what its functions do."""
        if not _of_library(kind.__module__) and self._strict:
            raise UnknownContentError(f"{kind.__qualname__}, which may be defined anew")
        found: list[Any] = [f"{kind.__module__}.{kind.__qualname__}"]
        if not _of_library(kind.__module__):
            found += [part for _, part in sorted(vars(kind).items()) if isinstance(part, types.FunctionType)]
        return found

    def _function(self, function) -> list:
        """Code, defaults, closure and the globals that are read; of a library's function its name."""
        name = f"{function.__module__}.{function.__qualname__}"
        if _of_library(function.__module__) and "<" not in name:
            return [name]
        cells = [cell.cell_contents for cell in function.__closure__ or () if cell != types.CellType()]
        read = sorted(set(_names(function.__code__)) & function.__globals__.keys())
        found = [function.__code__, function.__defaults__, function.__kwdefaults__ or {}, *cells]
        for name in read:
            value = function.__globals__[name]
            if isinstance(value, types.ModuleType) and not _of_library(value.__name__) and self._strict:
                raise UnknownContentError(f"module {name}, whose entries may change")
            found += [name, value]
        return found


def _of_library(module) -> bool:
    """True if a module is one whose entries do not change."""
    root = str(module).partition(".")[0]
    return root in _LIBRARIES or (root in sys.stdlib_module_names and root != "__main__")


def _names(code) -> Iterator[str]:
    """Names of globals and attributes that code reads, that inside of it too."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _names(constant)
