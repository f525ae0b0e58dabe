"""Fields of laws: numbers become array leaves, functions pytrees; values are checked when they are known."""

import dataclasses
import inspect
import types
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import numpy as np

from ..checks import any_concrete, is_concrete
from ..runtime import KnownFunction, as_array


def number(value: Any) -> jax.Array:
    """Array leaf of the default float type; takes Python numbers, arrays, tracers and sequences of them."""
    return as_array(value)


def optional_number(value: Any) -> jax.Array | None:
    """`number`, or None where there is none."""
    return None if value is None else number(value)


class StaticFunction(eqx.Module):
    """A callable whose arrays are leaves and whose code and settings are static.

    Two of them have the same structure if their functions have the same content: code, and what it reads.  A function
    that reads objects of the user's own classes or modules is like itself alone: define it once.
    """

    arrays: list[Any]
    treedef: Any = eqx.field(static=True)
    settings: tuple[Any, ...] = eqx.field(static=True)

    def __repr__(self):
        names = [getattr(part, "__name__", "") for is_array, part in self.settings if not is_array]
        return f"a function, {names[0]}" if len(names) == 1 and names[0] != "<lambda>" else "a function"

    def __call__(self, *args):
        arrays = iter(self.arrays)
        leaves = [next(arrays) if is_array else setting for is_array, setting in self.settings]
        return jax.tree.unflatten(self.treedef, leaves)(*args)


def as_function(fn: Callable) -> Callable:
    """A callable as a pytree of arrays: modules of arrays alone stay as they are, others are wrapped.

    Raises:
        TypeError: for what cannot be called, and for plain functions that close over traced values.
    """
    if not callable(fn):
        raise TypeError(f"expected a function or a callable module, got {type(fn).__name__}")
    if not is_concrete(_closed_over(fn)):
        name = getattr(fn, "__name__", "the function")
        raise TypeError(
            f"{name} closes over traced values, which are lost to derivatives: make them fields of an "
            "eqx.Module with a __call__, or pass them first by jax.tree_util.Partial(function, values)"
        )
    if isinstance(fn, jax.tree_util.Partial):
        fn = jax.tree_util.Partial(KnownFunction(fn.func), *fn.args, **fn.keywords)
    leaves, treedef = jax.tree.flatten(fn)
    leaves = [as_array(leaf, None) if isinstance(leaf, (float, np.ndarray)) else leaf for leaf in leaves]
    flags = [eqx.is_array(leaf) for leaf in leaves]
    if all(flags):
        return jax.tree.unflatten(treedef, leaves)
    arrays = [leaf for leaf, flag in zip(leaves, flags, strict=True) if flag]
    leaves = [KnownFunction(leaf) if callable(leaf) else leaf for leaf in leaves]
    settings = tuple((flag, None if flag else leaf) for leaf, flag in zip(leaves, flags, strict=True))
    return StaticFunction(arrays, treedef, settings)


def as_law_function(fn: Callable) -> Callable:
    """`as_function` of a law, whose time comes last.

    Raises: ValueError where the first of several arguments is called t or time, the order of earlier versions.
    """
    try:
        names = list(inspect.signature(fn).parameters)
    except (TypeError, ValueError):
        names = []
    if len(names) > 1 and names[0] in ("t", "time"):
        rest = ", ".join([*names[1:], names[0]])
        raise ValueError(f"time is the last argument: function({rest}), not function({', '.join(names)})")
    return as_function(fn)


def _closed_over(fn: Callable) -> list[Any]:
    """Values that a plain function closes over."""
    cells = getattr(fn, "__closure__", None) or ()
    return [cell.cell_contents for cell in cells if cell != types.CellType()]


def value_faults(module: eqx.Module) -> list[str]:
    """Known entries that are not numbers or infinite, and the faults of the signals the module holds.

    Fields that the module lists as `unbounded` may be infinite.
    """
    found = []
    for field in dataclasses.fields(module):
        value = getattr(module, field.name)
        if hasattr(value, "faults"):
            found += [f"{field.name}: {message}" for message in value.faults()]
        elif any(any_concrete(np.isnan, leaf) for leaf in jax.tree.leaves(value) if eqx.is_inexact_array(leaf)):
            found.append(f"{field.name} is not a number")
        elif field.name not in getattr(module, "unbounded", ()) and any(
            any_concrete(np.isinf, leaf) for leaf in jax.tree.leaves(value) if eqx.is_inexact_array(leaf)
        ):
            found.append(f"{field.name} is not finite")
    return found
