"""Functions and settings known by what they hold: code, constants, what they close over, and globals they read."""

import dataclasses
import enum
import functools
import hashlib
import operator
import re
import types
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import equinox as eqx
import jax
import numpy as np
from jax.extend.core import ClosedJaxpr, Jaxpr

from ..checks import is_concrete
from ._code_content import (
    UnknownContentError,
    builtin_parts,
    class_parts,
    code_parts,
    function_parts,
    is_constant_module,
)

_NUMBERS = (bool, int, float, complex, str, bytes, type(None), type(...), range, slice)
_DESCRIPTORS = (types.MethodDescriptorType, types.WrapperDescriptorType, types.ClassMethodDescriptorType)
_GETTERS = (operator.itemgetter, operator.attrgetter, operator.methodcaller)
#: Rules for derivatives and batches that functions of JAX and equinox carry.
_RULES = ("jvp", "fwd", "bwd", "vmap_rule", "transpose")
_MOST_TOKENS = 300_000  # of a content; what holds more is like no other


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

    def __content__(self) -> list:
        return [self.function]

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

    Raises: UnknownContentError.
    """
    found = hashlib.sha256()
    for number, token in enumerate(_Reader(strict).tokens(value)):
        if strict and number > _MOST_TOKENS:
            raise UnknownContentError(f"more than {_MOST_TOKENS} parts")
        found.update(token.encode(errors="surrogatepass") + b"\n")
    return found.hexdigest()


class _Reader:
    def __init__(self, strict: bool):
        self._strict = strict
        self._open: dict[int, int] = {}  # objects that are being read, and their depth

    def tokens(self, value: Any) -> Iterator[str]:
        """Contents of a value, in order."""
        if isinstance(value, _NUMBERS) and not isinstance(value, enum.Enum):
            yield f"{type(value).__name__} {value!r}"
        elif isinstance(value, np.ndarray | np.generic | jax.Array):
            yield self._array(value)
        elif id(value) in self._open:
            yield f"the object {len(self._open) - self._open[id(value)]} above"
        else:
            self._open[id(value)] = len(self._open)
            yield f"{type(value).__module__}.{type(value).__qualname__}"
            for part in self._parts(value):
                yield from self.tokens(part)
            del self._open[id(value)]
            yield "end"

    def _array(self, value):
        if not is_concrete(value):
            raise UnknownContentError("a traced array")
        if jax.dtypes.issubdtype(value.dtype, jax.dtypes.extended):
            value = jax.random.key_data(value)
        array = np.asarray(value)
        if array.dtype.hasobject:
            raise UnknownContentError("an array of objects")
        digest = hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()
        return f"{type(value).__name__} {array.dtype.str}{array.shape} {getattr(value, 'weak_type', '')} {digest}"

    def _parts(self, value) -> list:
        """Parts of an object."""
        if not isinstance(value, type) and hasattr(type(value), "__content__"):
            return value.__content__()
        for kind, parts in _PARTS:
            if isinstance(value, kind):
                found = parts(value, self._strict)
                return found if isinstance(found, list) else [found]
        if dataclasses.is_dataclass(value):
            return [type(value), *_attributes(value)]
        if callable(getattr(value, "__wrapped__", None)):  # of jax.jit, and of rules for derivatives
            return [value.__wrapped__, *(getattr(value, rule, None) for rule in _RULES)]
        if self._strict:
            return _state(value)
        if isinstance(value, Mapping):
            return _items(value)
        return [re.sub(r" at 0x[0-9a-f]+", "", repr(value))]


def _attributes(value):
    """Names and values of a data class's fields; of a user's, of what else was set too."""
    names = {field.name for field in dataclasses.fields(value)}
    if not is_constant_module(type(value).__module__):
        names |= getattr(value, "__dict__", {}).keys()
    return [part for name in sorted(names) for part in (name, getattr(value, name, None))]


def _state(value):
    """State of an object, as `copy` and `pickle` take it."""
    try:
        found = "" if type(value) is object else value.__reduce_ex__(2)  # a plain object is known by its identity
    except Exception:  # noqa: BLE001 - what an object of the user's raises
        raise UnknownContentError(f"{value!r}") from None
    if not found:
        raise UnknownContentError(f"{value!r}")
    if isinstance(found, str):
        return [type(value), found]
    made, args, state, items, pairs = (*found, None, None, None)[:5]
    return [made, args, state, list(items or ()), list(pairs or ())]


def _module(value, strict):
    if strict and not is_constant_module(value.__name__):
        raise UnknownContentError(f"module {value.__name__}, whose entries may change")
    return value.__name__


def _jaxpr(value, strict):
    if strict:  # larger than what it was traced from
        raise UnknownContentError("a traced program")
    return str(value)


def _set(value, strict):
    return sorted(content_of(part, strict) for part in value)


def _items(value):
    return [part for item in value.items() for part in item]


def _more_of(mapping):
    """State of a kind of dictionary beside its items."""
    return [getattr(mapping, "default_factory", None), *_items(getattr(mapping, "__dict__", {}))]


#: The parts of an object by its type, the first that fits.
_PARTS: list[tuple[Any, Callable[[Any, bool], Any]]] = [
    (types.FunctionType, function_parts),
    (types.CodeType, code_parts),
    (type, class_parts),
    (types.ModuleType, _module),
    (types.BuiltinFunctionType | types.MethodWrapperType | np.ufunc, builtin_parts),
    (_DESCRIPTORS, lambda value, _: [value.__objclass__, value.__name__]),
    (types.MethodType, lambda value, _: [value.__self__, value.__func__]),
    (functools.partial, lambda value, _: [value.func, value.args, value.keywords]),
    (_GETTERS, lambda value, _: list(value.__reduce__())),
    (staticmethod | classmethod, lambda value, _: value.__func__),
    (property, lambda value, _: [value.fget, value.fset]),
    (np.dtype, lambda value, _: value.str),
    (jax.tree_util.PyTreeDef, lambda value, _: [value.node_data(), *value.children()]),
    (enum.Enum, lambda value, _: [type(value), value.name]),
    (tuple | list, lambda value, _: list(value)),
    (ClosedJaxpr | Jaxpr, _jaxpr),
    (set | frozenset, _set),
    (dict, lambda value, _: _items(value) if type(value) is dict else [*_items(value), *_more_of(value)]),
    (types.MappingProxyType, lambda value, _: _items(value)),
]
