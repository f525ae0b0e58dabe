"""Annotations of fields: test for arrays, and for values that match."""

import types
from collections.abc import Callable, Mapping
from typing import Annotated, Any, Union, get_args, get_origin

import jax
import numpy as np


def alternatives(wanted: Any) -> tuple:
    """The types of a union, or the one type."""
    if get_origin(wanted) is Annotated:  # of Any: what belongs there is said beside it
        held, *said = get_args(wanted)
        return alternatives(said[0] if held is Any else held)
    if get_origin(wanted) in (Union, types.UnionType):
        return tuple(one for part in get_args(wanted) for one in alternatives(part))
    return (wanted,)


def is_array(wanted: Any) -> bool:
    """True if the annotation allows an array."""
    return any(_is_array_type(one) for one in alternatives(wanted))


def _is_array_type(one) -> bool:
    if hasattr(one, "array_type"):  # of jaxtyping, with a shape
        return one.array_type is not Any
    return isinstance(one, type) and issubclass(one, jax.Array | np.ndarray)


def matches(value: Any, wanted: Any) -> bool:
    """True if a value matches the annotation."""
    return any(_matches_one(value, one) for one in alternatives(wanted))


def _matches_one(value, one) -> bool:
    if one is Any or not (isinstance(one, type) or get_origin(one) or one is None or one is Callable):
        return True
    if one is None or one is type(None):
        return value is None
    if one is Callable or get_origin(one) is Callable or get_origin(one) is type(Callable):
        return callable(value)
    inside = get_args(one)
    if get_origin(one) is tuple:
        if not isinstance(value, tuple):
            return False
        if len(inside) == 2 and inside[1] is Ellipsis:
            return all(matches(item, inside[0]) for item in value)
        return len(value) == len(inside) and all(map(matches, value, inside))
    if get_origin(one) in (dict, Mapping):
        return isinstance(value, dict) and all(
            matches(k, inside[0]) and matches(v, inside[1]) for k, v in value.items()
        )
    if get_origin(one) is not None:
        return True
    if one is float:
        return isinstance(value, float | int) and not isinstance(value, bool)
    if one is int:
        return isinstance(value, int) and not isinstance(value, bool)
    return isinstance(value, one)


def value_annotation(wanted: Any) -> Any:
    """The type of the values of a mapping, where the annotation says it."""
    found = [get_args(one)[1] for one in alternatives(wanted) if get_origin(one) in (dict, Mapping)]
    return found[0] if len(found) == 1 else Any


def describe_annotation(wanted: Any) -> str:
    """Description of an annotation for messages."""
    return " or ".join(dict.fromkeys(_describe_one(one) for one in alternatives(wanted)))


def _describe_one(one):
    if hasattr(one, "array_type"):
        return f"array ({one.dim_str})" if one.dim_str else "number"
    if one is type(None):
        return "null"
    return getattr(one, "__name__", str(one))
