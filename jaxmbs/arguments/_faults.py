"""Faults of the arguments of a call that failed: text, None, huge numbers, other kinds of things, shapes."""

import inspect
import re
import types
import typing
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import jax
import numpy as np

from ..checks import HUGE_INTEGER, count_text

_SHAPES = re.compile("shape|broadcast|inhomogeneous|dimension", re.IGNORECASE)
#: Errors of NumPy and JAX about text in the place of numbers.
_ABOUT_TEXT = re.compile(r"valid JAX (array )?type|could not convert|invalid literal|StrDType")
_NUMBERS = (float, int, complex, np.ndarray, np.generic, jax.Array)


def argument_faults(
    function: Callable, args: tuple, options: Mapping[str, Any], error: Exception | None = None
) -> list[str]:
    """A sentence for each argument of a call that is wrong by itself; if there is none, one for what the error is
    about, or for those that are empty, or one that tells which shapes do not fit together."""
    signature = inspect.signature(function)
    try:
        given = signature.bind(*args, **options).arguments
    except TypeError:
        return []
    known = [
        (name, value, signature.parameters[name]) for name, value in given.items() if name not in ("self", "cls")
    ]
    return (
        [fault for name, value, parameter in known for fault in _parameter_faults(name, value, parameter)]
        or [
            f"{name}: a number is needed, not the text {_short_text(text)}"
            for name, value, parameter in known
            if (text := _text_at_fault(error, value, parameter.annotation)) is not None
        ]
        or [
            f"{name} cannot hold {_short_text(_subject(error))}"
            for name, value, _ in known
            if _is_about(error, value)
        ]
        or [f"{name} is empty" for name, value, _ in known if _is_empty(value)]
        or (_shape_faults(known) if _SHAPES.search(str(error)) else [])
    )


def _parameter_faults(name, value, parameter) -> Iterator[str]:
    if parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
        entries = value.items() if isinstance(value, dict) else enumerate(value)
        for key, entry in entries:
            yield from _faults(key if isinstance(key, str) else f"{name}[{key}]", entry, parameter.annotation)
    elif value is not None or parameter.default is not None:
        yield from _faults(name, value, parameter.annotation)


def _faults(name, value, annotation) -> Iterator[str]:
    """Sentences for a value, or for what it holds."""
    kinds = set(_kinds(annotation))
    huge = next((x for x in _leaves(value) if _is_huge(x)), None)
    if huge is not None:
        yield f"{name} is too large: {count_text(huge)}"
    elif object in kinds or isinstance(value, jax.core.Tracer):
        return
    elif value is None:
        if type(None) not in kinds:
            yield f"{name} must be given, not None"
    elif not _is_one_of(value, kinds):
        yield f"{name} must be {_in_words(kinds)}, not {_short_text(value)}"
    elif _is_text(value) and str not in kinds and not _entries(annotation):
        yield f"{name} must be {_in_words(kinds)}, not text: {_short_text(value)}"
    else:
        for inner in _entries(annotation):
            held = value.items() if isinstance(value, Mapping) else enumerate(value)
            for key, entry in [] if isinstance(value, np.ndarray | jax.Array | Iterator) else held:
                yield from _faults(f"{name}[{key!r}]", entry, inner)


def _entries(annotation) -> list:
    """The annotation of what a list or dictionary holds, if it says that of one kind."""
    parts = [x for x in typing.get_args(annotation) if x is not type(None)]
    origin = typing.get_origin(annotation)
    if origin in (typing.Union, types.UnionType):
        return _entries(parts[0]) if len(parts) == 1 else []
    if inspect.isclass(origin) and issubclass(origin, Mapping):
        return parts[1:]
    if origin is tuple:
        return parts[:1] if len(parts) == 2 and parts[1] is ... else []
    return parts if inspect.isclass(origin) and issubclass(origin, Iterable) else []


def _subject(error):
    """The object without an attribute, or the key that is not there."""
    if isinstance(error, AttributeError):
        return error.obj
    return error.args[0] if isinstance(error, KeyError) and error.args else None


def _text_at_fault(error, value, annotation):
    """The text in a value that an error is about, or None; what a value may hold is not always told.

    Errors that do not quote it are about the text in what is not annotated as text.
    """
    if not _ABOUT_TEXT.search(str(error)):
        return None
    texts = [x for x in _leaves(value) if isinstance(x, str)]
    quoted = [x for x in texts if repr(x) in str(error)]
    is_untold = "StrDType" in str(error) and not re.search(r"\bstr\b", str(annotation))
    return next(iter(quoted or (texts if is_untold else ())), None)


def _is_about(error, value):
    subject = _subject(error)
    if subject is None and not (isinstance(error, AttributeError) and "NoneType" in str(error)):
        return False
    held = jax.tree.leaves(value, is_leaf=lambda x: x is None) if isinstance(value, dict | list | tuple) else [value]
    return any(x is subject or (isinstance(x, str | int) and x == subject) for x in held)


def _kinds(annotation) -> Iterator[type]:
    """The classes that an annotation allows; `object` for anything, as where it says nothing."""
    origin = typing.get_origin(annotation)
    if origin in (typing.Union, types.UnionType):
        for part in typing.get_args(annotation):
            yield from _kinds(part)
    elif annotation is None:
        yield type(None)
    elif hasattr(annotation, "dim_str"):  # of jaxtyping
        yield from _NUMBERS
        yield from (list, tuple)
    elif inspect.isclass(origin):
        yield origin
    elif inspect.isclass(annotation) and annotation not in (Any, inspect.Parameter.empty):  # `Any` is a class, too
        yield annotation
        if issubclass(annotation, float | complex):
            yield from _NUMBERS
        elif annotation is int:
            yield np.integer
    else:
        yield object


def _is_one_of(value, kinds):
    if isinstance(value, str) and str not in kinds:  # which is a sequence, too
        return False
    try:
        return isinstance(value, tuple(kinds))
    except TypeError:  # a protocol
        return True


def _in_words(kinds):
    """The kinds in words."""
    words = []
    if kinds & {float, complex, jax.Array, np.ndarray}:
        words.append("numbers")
    elif int in kinds:
        words.append("a whole number")
    if bool in kinds and not words:
        words.append("True or False")
    others = kinds - {*_NUMBERS, np.integer, bool, type(None), *((list, tuple) if words else ())}
    words += sorted({"a function" if kind is Callable else f"a {_name_of(kind)}" for kind in others})
    return " or ".join(words)


def _name_of(kind):
    if kind in (str, Mapping):
        return "text" if kind is str else "dictionary"
    return "list" if kind in (list, tuple, Sequence, Iterable) else kind.__name__


def _short_text(value):
    text = repr(value)
    return text if len(text) <= 60 else f"{type(value).__name__} {text[:50]}..."


def _leaves(value):
    """Parts of a value, at most the first thousand."""
    return jax.tree.leaves(value)[:1000]


def _is_huge(x):
    if isinstance(x, np.ndarray) and x.dtype == object:
        return any(map(_is_huge, x.ravel()))
    return isinstance(x, int) and abs(x) >= HUGE_INTEGER


def _is_text(value):
    """True if some entry of lists or arrays is text."""
    entries = _leaves(value) if isinstance(value, list | tuple | np.ndarray) else []
    return any(isinstance(x, str | bytes) or (isinstance(x, np.ndarray) and x.dtype.kind in "US") for x in entries)


def _is_empty(value):
    """True for arrays and lists of nothing."""
    if isinstance(value, np.ndarray | jax.Array):
        return value.size == 0
    return isinstance(value, list | tuple | dict | str) and not value


def _shape_faults(known):
    """One sentence with the shapes of all arrays of numbers, where there are some."""
    arrays = [
        (name + jax.tree_util.keystr(path), leaf)
        for name, value, _ in known
        for path, leaf in jax.tree_util.tree_leaves_with_path(_as_array(value))
    ]
    shapes = [f"{name} {np.shape(leaf)}" for name, leaf in arrays if isinstance(leaf, np.ndarray | jax.Array)]
    return [f"these shapes do not fit: {', '.join(shapes[:12])}"] if shapes else []


def _as_array(value):
    """Rows of numbers as an array; other things as they are."""
    if not isinstance(value, list | tuple):
        return value
    try:
        return np.asarray(value, float)
    except (TypeError, ValueError):
        return value
