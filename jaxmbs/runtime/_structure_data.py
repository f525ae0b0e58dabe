"""The structure of results as data: pytrees of the library's classes to what JSON holds, and back; no code is run.

Reading makes objects of known classes and sets their fields; no constructor, reducer or function of a file is called.
"""

import base64
import dataclasses
import enum
import importlib
import sys
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import jax
import numpy as np

_PLAIN = (bool, int, str, type(None))


def to_data(value: Any, where: str = "the result", told: Callable[[Any], Any] = lambda value: None) -> Any:
    """A pytree, its static settings and the numbers in place of its leaves.

    Args: told: the data of a part that is known otherwise; None for other parts.

    Raises: TypeError naming the part that is no data: a function, or an object of a class that has no fields.
    """
    if (found := told(value)) is not None:
        return found
    if isinstance(value, enum.Enum):
        return {"enum": _name(type(value), where), "member": value.name}
    if type(value) in _PLAIN:
        return value
    if isinstance(value, float):
        return {"float": value.hex()}
    if isinstance(value, str):
        return {"words": _name(type(value), where), "text": str(value)}
    if isinstance(value, np.ndarray | np.generic | jax.Array):
        array = np.asarray(value)
        return {"array": array.dtype.name, "shape": array.shape, "bytes": base64.b64encode(array.tobytes()).decode()}
    if isinstance(value, np.dtype):
        return {"dtype": value.name}
    if isinstance(value, type):
        return {"class": _name(value, where)}
    if isinstance(value, dict):
        rows = [[to_data(key, where, told), to_data(part, f"{where}[{key!r}]", told)] for key, part in value.items()]
        return {"dict": rows}
    if hasattr(value, "_fields"):
        parts = [to_data(part, f"{where}.{name}", told) for name, part in zip(value._fields, value, strict=True)]
        return {"record": _name(type(value), where), "items": parts}
    for kind in (list, tuple, frozenset):
        if type(value) is kind:
            return {kind.__name__: [to_data(part, f"{where}[{k}]", told) for k, part in enumerate(value)]}
    if dataclasses.is_dataclass(value):
        names = [field.name for field in dataclasses.fields(value) if hasattr(value, field.name)]
        parts = {name: to_data(getattr(value, name), f"{where}.{name}", told) for name in names}
        return {"object": _name(type(value), where), "fields": parts}
    raise TypeError(f"{where} holds {value!r}, which cannot be stored as data: return arrays in its place")


def from_data(data: Any, readers: Mapping[str, Callable[[dict], Any]] = MappingProxyType({})) -> Any:
    """The object that `to_data` made data of.

    Args: readers: of what was `told`, by the first name in its data.

    Raises: ValueError for what it did not make, and for a class of the user's whose module is not imported.
    """
    if type(data) in _PLAIN:
        return data
    if not isinstance(data, dict):
        raise ValueError(f"no structure: {data!r}")
    kind = next(iter(data), "")
    if kind in readers:
        return readers[kind](data)
    if kind not in _READERS:
        raise ValueError(f"no structure: {kind!r}")
    return _READERS[kind](data, lambda part: from_data(part, readers))


def _array(data, _):
    array = np.frombuffer(base64.b64decode(data["bytes"]), np.dtype(data["array"]))
    return array.reshape(data["shape"])


def _record(data, read):
    return tuple.__new__(_class(data["record"], tuple), [read(part) for part in data["items"]])


def _object(data, read):
    kind, fields = _class(data["object"], object), data["fields"]
    known = {field.name for field in dataclasses.fields(kind)} if dataclasses.is_dataclass(kind) else set()
    if not fields.keys() <= known:
        raise ValueError(f"{data['object']} has no fields {', '.join(sorted(fields.keys() - known))}")
    made = object.__new__(kind)
    for name, part in fields.items():
        object.__setattr__(made, name, read(part))
    return made


_READERS: dict[str, Callable[[dict, Callable], Any]] = {
    "float": lambda data, _: float.fromhex(data["float"]),
    "words": lambda data, _: str.__new__(_class(data["words"], str), data["text"]),
    "array": _array,
    "dtype": lambda data, _: np.dtype(data["dtype"]),
    "class": lambda data, _: _class(data["class"], object),
    "enum": lambda data, _: _class(data["enum"], enum.Enum)[data["member"]],
    "dict": lambda data, read: {read(key): read(part) for key, part in data["dict"]},
    "list": lambda data, read: [read(part) for part in data["list"]],
    "tuple": lambda data, read: tuple(read(part) for part in data["tuple"]),
    "frozenset": lambda data, read: frozenset(read(part) for part in data["frozenset"]),
    "record": _record,
    "object": _object,
}


def _name(kind: type, where: str) -> str:
    if "<" in kind.__qualname__:
        raise TypeError(f"{where} is of a class inside of a function, {kind.__qualname__}: define it in a module")
    return f"{kind.__module__}:{kind.__qualname__}"


def _class(name: str, base: type) -> Any:
    """A class of this library, or of a module that is imported already: reading a file imports none of others."""
    place, _, path = name.partition(":")
    if place.partition(".")[0] == __name__.partition(".")[0] and not place.endswith("__main__"):
        importlib.import_module(place)
    found: Any = sys.modules.get(place)
    if found is None:
        raise ValueError(f"it holds a {name.replace(':', '.')}: import {place} first")
    for part in path.split("."):
        found = vars(found).get(part)
    if not (isinstance(found, type) and issubclass(found, base)):
        raise ValueError(f"{name} is no class of this kind")
    return found
