"""Structures of results as data, by which another process makes of a program's arrays what the function returns."""

import dataclasses
from collections.abc import Iterator
from typing import Any

import equinox as eqx
import jax

from ._structure_data import from_data, to_data

_PLAIN = (bool, int, float, complex, str, bytes, type(None))


@dataclasses.dataclass(frozen=True)
class _Place:
    """Stands for an array of the results."""

    number: int


def results_to_data(structure: Any, static: Any, arguments: Any) -> Any:
    """Results as data: `structure` of their arrays, and `static` for the rest.

    Settings that the arguments have too (functions, a topology) are told by their place in them.

    Raises: TypeError naming what is no data.
    """
    places = [_Place(number) for number in range(structure.num_leaves)]
    known = {id(value): number for number, value in enumerate(_settings(arguments))}

    def told(value):
        if isinstance(value, _Place):
            return {"result": value.number}
        return {"setting": known[id(value)]} if id(value) in known else None

    return to_data(eqx.combine(jax.tree.unflatten(structure, places), static), "the result", told)


def results_from_data(data: Any, arguments: Any) -> tuple[Any, Any]:
    """Structure of the results' arrays, and what of them is static.  Raises: ValueError for what was not stored."""
    settings = list(_settings(arguments))
    readers = {"result": lambda data: _Place(data["result"]), "setting": lambda data: settings[data["setting"]]}
    try:
        found = from_data(data, readers)
    except (KeyError, IndexError, TypeError, AttributeError) as error:
        raise ValueError(f"no results: {error}") from None
    dynamic, static = eqx.partition(found, lambda leaf: isinstance(leaf, _Place))
    places, structure = jax.tree.flatten(dynamic)
    if [place.number for place in places] != list(range(len(places))):
        raise ValueError("no results: their order is another")
    return structure, static


def _settings(value: Any) -> Iterator[Any]:
    """Objects in the arguments that are neither numbers nor containers, in order."""
    if isinstance(value, dict):
        for part in value.values():
            yield from _settings(part)
    elif isinstance(value, tuple | list):
        for part in value:
            yield from _settings(part)
    elif isinstance(value, _PLAIN) or hasattr(value, "dtype"):
        return
    else:
        yield value
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            for field in dataclasses.fields(value):
                yield from _settings(getattr(value, field.name, None))
