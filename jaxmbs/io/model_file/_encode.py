"""Encoding of objects to JSON: one rule for all classes, field by field."""

import dataclasses
import functools
import math
from typing import Any

import jax
import numpy as np

from ...builder import SystemBuilder
from ...checks import is_concrete
from ...forces._fields import StaticFunction
from ...runtime import KnownFunction
from ._registry import ROWS, name_of

RESERVED = ("type", "function", "mapping", "real")


def encode(value: Any, where: str, faults: list[str]) -> Any:
    """Encode an object as a JSON value.

    Numbers stay exact; infinite ones are "inf", "-inf", "nan".  Objects are mappings with a "type", functions ones
    with a "function"; sequences come back as tuples.  Faults: what is traced, or has no name.
    """
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, jax.Array | np.ndarray | np.generic | int | float | complex):
        return _encode_number(value, where, faults)
    if isinstance(value, dict):
        return _encode_mapping(value, where, faults)
    if isinstance(value, SystemBuilder):
        found = value.faults()
        faults += [f"{where}: {fault}" for fault in found]
        return {} if found else {"type": "SystemBuilder", **_encode_tables(value.declared, where, faults)}
    if isinstance(value, StaticFunction):
        return encode(_wrapped_callable(value), where, faults)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return _encode_record(value, [f.name for f in dataclasses.fields(value)], where, faults)
    if hasattr(value, "_fields"):
        return _encode_record(value, value._fields, where, faults)
    if isinstance(value, tuple | list):
        return [encode(item, f"{where}[{k}]", faults) for k, item in enumerate(value)]
    return _encode_function(value, where, faults)


def _encode_number(value, where, faults):
    if not is_concrete(value):
        faults.append(f"{where} is traced: save the model outside of jit, grad and vmap")
        return None
    array = np.asarray(value)
    if array.dtype == bool or np.issubdtype(array.dtype, np.integer):
        return array.tolist()
    if np.iscomplexobj(array):
        return {"real": _encode_floats(array.real.tolist()), "imag": _encode_floats(array.imag.tolist())}
    return _encode_floats(array.astype(float).tolist())


def _encode_floats(value):
    if isinstance(value, list):
        return [_encode_floats(item) for item in value]
    return value if math.isfinite(value) else str(value)


def _encode_mapping(value, where, faults):
    plain = all(isinstance(key, str) and key not in RESERVED for key in value)
    if plain:
        return {key: encode(item, f"{where}.{key}", faults) for key, item in value.items()}
    return {"mapping": [encode(pair, where, faults) for pair in value.items()]}


def _encode_tables(declared, where, faults):
    """A builder's tables; a thing's name is its key."""
    found: dict = {"gravity": encode(declared.gravity, f"{where}.gravity", faults)}
    for table, kind in ROWS.items():
        fields = [field.name for field in dataclasses.fields(kind) if field.name != "name"]
        rows = getattr(declared, table)
        found |= {table: {name: {} for name in rows}} if rows else {}
        for name, row in rows.items():
            found[table][name] = _nonempty_fields(row, fields, f"{where}.{table}.{name}", faults)
    return found


def _encode_record(value, fields, where, faults):
    name = name_of(type(value))
    if getattr(value, "runs_foreign_code", False):
        faults.append(
            f"{where}: {type(value).__name__} runs foreign code, which no file brings: add it after loading"
        )
        return {}
    if name is None:
        kind = type(value).__name__
        faults.append(
            f"{where}: {kind} is no class of the library: `mbs.io.register({kind.lower()!r}, {kind})` names it"
        )
        return {}
    return {"type": name, **_nonempty_fields(value, fields, where, faults)}


def _nonempty_fields(value, fields, where, faults):
    """Fields of a record that are neither None nor a default that is off."""
    off = {name for name in fields if getattr(type(value), name, None) is False}
    own = {name: getattr(value, name) for name in fields}
    kept = {name: x for name, x in own.items() if x is not None and not (x is False and name in off)}
    return {name: encode(x, f"{where}.{name}", faults) for name, x in kept.items()}


def _wrapped_callable(wrapped: StaticFunction):
    """The callable that a law wrapped for its leaves."""
    arrays = iter(wrapped.arrays)
    leaves = [next(arrays) if is_array else setting for is_array, setting in wrapped.settings]
    return jax.tree.unflatten(wrapped.treedef, leaves)


def _encode_function(value, where, faults):
    if isinstance(value, functools.partial):  # that of JAX is one
        found = _encode_function(value.func, where, faults)
        if value.args:
            found["arguments"] = encode(value.args, f"{where}.arguments", faults)
        if value.keywords:
            found["keywords"] = encode(value.keywords, f"{where}.keywords", faults)
        return found
    value = value.function if isinstance(value, KnownFunction) else value
    name = name_of(value)
    if name is None:
        own = getattr(value, "__qualname__", type(value).__name__)
        faults.append(f"{where}: {own} has no name: `mbs.io.register('...', {own.rpartition('.')[2]})` gives it one")
    return {"function": name}
