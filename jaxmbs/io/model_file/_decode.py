"""Decoding of JSON to objects, by the types that their classes declare; all faults are collected."""

import dataclasses
import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ... import fem
from ...builder import SystemBuilder
from ...checks import no_such
from ...elements import DIRECTIONS
from ...linear import LinearSystem
from ...named_arrays import element_of
from ...runtime import as_array
from ._annotations import alternatives, describe_annotation, is_array, matches, value_annotation
from ._registry import ROWS, class_of, function_of, registered_names

_MOST_FAULTS = 50
_SPECIAL_FLOATS = {"inf": math.inf, "-inf": -math.inf, "nan": math.nan}


def _structure(given):
    """A structure from what it holds: elements of a group are one for all, or stacked."""
    elements, names = {}, given["names"]
    for name, group in given["groups"].items():
        count = 0 if group.shared else len(group.nodes)
        each = [element_of(group.element, k) for k in range(count)]
        elements[name] = (group.element if group.shared else each, [[names[n] for n in row] for row in group.nodes])
    held: dict = {}
    for node, direction in given["held"]:
        held.setdefault(names[node], []).append(DIRECTIONS[direction])
    return fem.Structure(dict(zip(names, given["positions"], strict=True)), elements, held)


def _linear_system(given):
    places = given["positions"]
    given = {name: value for name, value in given.items() if name != "nodes"} | {
        "positions": None if places is None else (given["nodes"], places)
    }
    return LinearSystem(**given)


_CONSTRUCTORS = {fem.Structure: _structure, LinearSystem: _linear_system}


class _InvalidType:
    """Placeholder for a value that could not be read; its fault is in the list."""


INVALID, _NOTHING = _InvalidType(), _InvalidType()


def decode(value: Any, wanted: Any, where: str, faults: list[str]) -> Any:
    """The object that JSON value stands for, of the `wanted` annotation; LOST, and a fault, where it is none."""
    if len(faults) > _MOST_FAULTS:
        return INVALID
    if is_array(wanted) and _is_numeric(value, wanted):
        found = _with_columns(_as_array(value), wanted)
        numeric = found is not None and (not np.iscomplexobj(found) or _has_shape(wanted))
        own = (as_array(found, None) if _is_leaf(wanted) else found) if numeric else _NOTHING
    elif isinstance(value, dict):
        own = _decode_object(value, wanted, where, faults)
    elif isinstance(value, list):
        own = tuple(decode(item, Any, f"{where}[{k}]", faults) for k, item in enumerate(value))
        own = INVALID if any(item is INVALID for item in own) else own
    else:
        own = value
    if own is not INVALID and not matches(own, wanted):
        faults.append(f"{where}: {_shorten(value)} is no {describe_annotation(wanted)}")
        return INVALID
    return own


def _is_numeric(value, wanted):
    """True if the annotation allows numbers and no other reading of the value fits."""
    if isinstance(value, str):
        return value in _SPECIAL_FLOATS and str not in alternatives(wanted)
    if isinstance(value, dict):
        return value.keys() == {"real", "imag"}
    return isinstance(value, list | int | float) and not isinstance(value, bool)


def _is_leaf(wanted):
    """True if the annotation is a JAX array; declarations of a builder take NumPy arrays, which is faster."""
    return not any(one is np.ndarray for one in alternatives(wanted))


def _has_shape(wanted):
    """True if the annotation is an array of a shape and type, which determines if it may be complex."""
    return any(hasattr(one, "array_type") for one in alternatives(wanted))


def _shorten(value):
    text = repr(value)
    return text if len(text) <= 40 else text[:37] + "..."


def _as_array(value):
    """An array of a number or nested lists of numbers, complex where "real" and "imag" stand; else None."""
    if isinstance(value, dict) and value.keys() == {"real", "imag"}:
        real, imag = _as_array(value["real"]), _as_array(value["imag"])
        return None if real is None or imag is None or real.shape != imag.shape else real + 1j * imag
    try:
        flat = np.array(_replace_special_floats(value), dtype=jnp.result_type(float))
    except (TypeError, ValueError, OverflowError, RecursionError):
        return None
    return flat


def _with_columns(array, wanted):
    """The array; one without rows, `[]` in JSON, with the columns (0, 3) of an annotation (n, 3)."""
    if array is None or array.shape != (0,):
        return array
    for one in alternatives(wanted):
        _, *columns = getattr(one, "dim_str", "").split() or [""]
        if columns and all(size.isdigit() for size in columns):
            return array.reshape(0, *map(int, columns))
    return array


def _replace_special_floats(value):
    """Replace the words for infinity and NaN, which JSON lacks, by numbers.  Raises: TypeError for anything else."""
    if isinstance(value, list):
        return [_replace_special_floats(item) for item in value]
    if isinstance(value, str):
        if value not in _SPECIAL_FLOATS:
            raise TypeError(value)
        return _SPECIAL_FLOATS[value]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(value)
    return value


def _decode_object(value, wanted, where, faults):
    if "type" in value:
        return _decode_typed(value, where, faults)
    if "function" in value:
        return _decode_function(value, where, faults)
    if "mapping" in value:
        return _decode_pairs(value["mapping"], where, faults)
    if value.keys() == {"real", "imag"}:
        faults.append(f"{where}: a complex number has no place here")
        return INVALID
    held = value_annotation(wanted)
    found = {key: decode(item, held, f"{where}.{key}", faults) for key, item in value.items()}
    return INVALID if any(item is INVALID for item in found.values()) else found


def _decode_typed(value, where, faults):
    if value["type"] == "SystemBuilder":
        return _decode_builder(value, where, faults)
    kind = class_of(value["type"]) if isinstance(value["type"], str) else None
    if kind is None:
        faults.append(f"{where}: {no_such('type', value['type'], registered_names())} (your own: mbs.io.register)")
        return INVALID
    return decode_record(kind, {key: item for key, item in value.items() if key != "type"}, where, faults)


def _decode_pairs(pairs, where, faults):
    found = decode(pairs, Any, where, faults)
    try:
        return INVALID if found is INVALID else dict(found)
    except (TypeError, ValueError):
        faults.append(f"{where}: a mapping is a list of pairs")
        return INVALID


def _decode_function(value, where, faults):
    name = value["function"]
    function = function_of(name) if isinstance(name, str) else None
    if function is None:
        faults.append(
            f"{where}: no function {name!r} is registered: `mbs.io.register({name!r}, function)` before loading"
        )
        return INVALID
    arguments = decode(value.get("arguments", []), tuple, f"{where}.arguments", faults)
    keywords = decode(value.get("keywords", {}), dict, f"{where}.keywords", faults)
    if arguments is INVALID or keywords is INVALID:
        return INVALID
    return jax.tree_util.Partial(function, *arguments, **keywords) if arguments or keywords else function


def decode_record(kind: type, values: dict, where: str, faults: list[str]) -> Any:
    """An object of a class from its fields; the class's own checks are asked, its constructor only where it alone
    knows what belongs together."""
    if not dataclasses.is_dataclass(kind):
        wanted = {name: kind.__annotations__.get(name, Any) for name in getattr(kind, "_fields", ())}
        given = _decode_fields(wanted, {}, values, where, faults)
        return INVALID if given is INVALID else kind(**given)
    fields = dataclasses.fields(kind)
    defaults = {f.name: f.default for f in fields if f.default is not dataclasses.MISSING}
    given = _decode_fields({f.name: f.type for f in fields}, defaults, values, where, faults)
    if given is INVALID:
        return INVALID
    try:
        if kind in _CONSTRUCTORS:
            return _CONSTRUCTORS[kind](given)
        made = object.__new__(kind)
        for field in fields:
            convert = field.metadata.get("converter", lambda x: x)
            object.__setattr__(made, field.name, convert(given[field.name]))
        for parent in kind.__mro__:
            for check in ("__check_init__", "__post_init__"):
                if check in vars(parent):
                    vars(parent)[check](made)
    except Exception as error:  # noqa: BLE001 - the class says what is wrong with these values
        faults.append(f"{where}: {error}")
        return INVALID
    return made


def _decode_fields(wanted, defaults, values, where, faults):
    """Values by field; a missing one gets its default, else None."""
    odd = [key for key in values if key not in wanted]
    _report_unknown_keys(odd, "field", wanted, where, faults)
    found = {}
    for name, kind in wanted.items():
        if name in values:
            found[name] = decode(values[name], kind, f"{where}.{name}", faults)
        elif name in defaults or matches(None, kind):
            found[name] = defaults.get(name)
        else:
            faults.append(f"{where}: {name} is missing")
            found[name] = INVALID
    return INVALID if odd or any(item is INVALID for item in found.values()) else found


def _report_unknown_keys(odd, what, among, where, faults):
    """Report unknown keys, the first of them in full."""
    faults += [f"{where}: {no_such(what, key, among)}" for key in odd[:_MOST_FAULTS]]
    if len(odd) > _MOST_FAULTS:
        faults.append(f"{where}: there are {len(odd) - _MOST_FAULTS} more keys that have no place there")


def _decode_builder(value, where, faults):
    odd = [key for key in value if key not in ("type", "gravity", *ROWS)]
    _report_unknown_keys(odd, "table", ["gravity", *ROWS], where, faults)
    if "gravity" not in value:
        faults.append(f"{where}: gravity is missing")
    gravity = decode(value.get("gravity", [0.0, 0.0, 0.0]), jnp.ndarray, f"{where}.gravity", faults)
    builder, before = SystemBuilder(np.zeros(3) if gravity is INVALID else gravity), len(faults)
    for name in ROWS:
        rows = value.get(name, {})
        if not isinstance(rows, dict):
            faults.append(f"{where}.{name}: it must be a mapping of names")
            continue
        kind, table = ROWS[name], getattr(builder.declared, name)
        for key, row in rows.items():
            if len(faults) > _MOST_FAULTS:
                return INVALID
            at = f"{where}.{name}.{key}"
            if isinstance(row, dict) and row.get("name", key) != key:
                faults.append(f"{at}: it calls itself {_shorten(row['name'])}")
            made = decode_record(kind, {**row, "name": key}, at, faults) if isinstance(row, dict) else INVALID
            if not isinstance(row, dict):
                faults.append(f"{at}: it must be a mapping")
            if made is not INVALID:
                table[key] = made
    if len(faults) == before:
        faults += [f"{where}: {fault}" for fault in builder.faults()]
    return builder if len(faults) == before else INVALID
