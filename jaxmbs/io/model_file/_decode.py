"""From JSON back to objects, by the types that the classes themselves declare; every fault is collected."""

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
from ...runtime import as_array
from ._annotations import alternatives, fits, is_array, spoken
from ._registry import ROWS, class_of, function_of, names

_MOST_FAULTS = 50
_OWN = {"inf": math.inf, "-inf": -math.inf, "nan": math.nan}


def _structure(given):
    """A structure from what it holds: elements of a group are one for all, or stacked."""
    elements, names = {}, given["names"]
    for name, group in given["groups"].items():
        count = 0 if group.shared else len(group.nodes)
        each = [jax.tree.map(lambda x, k=k: x[k], group.element) for k in range(count)]
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


_MADE_BY = {fem.Structure: _structure, LinearSystem: _linear_system}


class _LostType:
    """What could not be read; its fault is in the list."""


LOST, _NOTHING = _LostType(), _LostType()


def decoded(value: Any, wanted: Any, where: str, faults: list[str]) -> Any:
    """The object that JSON value stands for, of the `wanted` annotation; LOST, and a fault, where it is none."""
    if len(faults) > _MOST_FAULTS:
        return LOST
    if is_array(wanted) and _is_numeric(value, wanted):
        found = _array(value)
        numeric = found is not None and (not np.iscomplexobj(found) or _has_shape(wanted))
        own = (as_array(found, None) if _is_leaf(wanted) else found) if numeric else _NOTHING
    elif isinstance(value, dict):
        own = _object(value, where, faults)
    elif isinstance(value, list):
        own = tuple(decoded(item, Any, f"{where}[{k}]", faults) for k, item in enumerate(value))
        own = LOST if any(item is LOST for item in own) else own
    else:
        own = value
    if own is not LOST and not fits(own, wanted):
        faults.append(f"{where}: {_short(value)} is no {spoken(wanted)}")
        return LOST
    return own


def _is_numeric(value, wanted):
    """Whether the value must be numbers if the annotation lets numbers stand there."""
    if isinstance(value, str):
        return value in _OWN and str not in alternatives(wanted)
    if isinstance(value, dict):
        return value.keys() == {"real", "imag"}
    return isinstance(value, list | int | float) and not isinstance(value, bool)


def _is_leaf(wanted):
    """Whether the annotation wants an array of JAX; declarations of a builder take one of NumPy, which is quicker."""
    return not any(one is np.ndarray for one in alternatives(wanted))


def _has_shape(wanted):
    """Whether the annotation is of arrays of a shape and type, which tells whether they may be complex."""
    return any(hasattr(one, "array_type") for one in alternatives(wanted))


def _short(value):
    text = repr(value)
    return text if len(text) <= 40 else text[:37] + "..."


def _array(value):
    """An array of a number or nested lists of numbers, complex where "real" and "imag" stand; else None."""
    if isinstance(value, dict) and value.keys() == {"real", "imag"}:
        real, imag = _array(value["real"]), _array(value["imag"])
        return None if real is None or imag is None or real.shape != imag.shape else real + 1j * imag
    try:
        flat = np.array(_spelled(value), dtype=jnp.result_type(float))
    except (TypeError, ValueError, OverflowError, RecursionError):
        return None
    return flat


def _spelled(value):
    """Numbers in place of the words for those that JSON has not.  Raises: TypeError for anything else."""
    if isinstance(value, list):
        return [_spelled(item) for item in value]
    if isinstance(value, str):
        if value not in _OWN:
            raise TypeError(value)
        return _OWN[value]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(value)
    return value


def _object(value, where, faults):
    if "type" in value:
        return _typed(value, where, faults)
    if "function" in value:
        return _function(value, where, faults)
    if "mapping" in value:
        return _pairs(value["mapping"], where, faults)
    if value.keys() == {"real", "imag"}:
        faults.append(f"{where}: a complex number has no place here")
        return LOST
    found = {key: decoded(item, Any, f"{where}.{key}", faults) for key, item in value.items()}
    return LOST if any(item is LOST for item in found.values()) else found


def _typed(value, where, faults):
    if value["type"] == "SystemBuilder":
        return _builder(value, where, faults)
    kind = class_of(value["type"]) if isinstance(value["type"], str) else None
    if kind is None:
        faults.append(f"{where}: {no_such('type', value['type'], names())} (your own: mbs.io.register)")
        return LOST
    return record(kind, {key: item for key, item in value.items() if key != "type"}, where, faults)


def _pairs(pairs, where, faults):
    found = decoded(pairs, Any, where, faults)
    try:
        return LOST if found is LOST else dict(found)
    except (TypeError, ValueError):
        faults.append(f"{where}: a mapping is a list of pairs")
        return LOST


def _function(value, where, faults):
    name = value["function"]
    function = function_of(name) if isinstance(name, str) else None
    if function is None:
        faults.append(
            f"{where}: no function {name!r} is registered: `mbs.io.register({name!r}, function)` before loading"
        )
        return LOST
    arguments = decoded(value.get("arguments", []), tuple, f"{where}.arguments", faults)
    keywords = decoded(value.get("keywords", {}), dict, f"{where}.keywords", faults)
    if arguments is LOST or keywords is LOST:
        return LOST
    return jax.tree_util.Partial(function, *arguments, **keywords) if arguments or keywords else function


def record(kind: type, values: dict, where: str, faults: list[str]) -> Any:
    """An object of a class from its fields; the class's own checks are asked, its constructor only where it alone
    knows what belongs together."""
    if not dataclasses.is_dataclass(kind):
        wanted = {name: kind.__annotations__.get(name, Any) for name in getattr(kind, "_fields", ())}
        given = _fields(wanted, {}, values, where, faults)
        return LOST if given is LOST else kind(**given)
    fields = dataclasses.fields(kind)
    defaults = {f.name: f.default for f in fields if f.default is not dataclasses.MISSING}
    given = _fields({f.name: f.type for f in fields}, defaults, values, where, faults)
    if given is LOST:
        return LOST
    try:
        if kind in _MADE_BY:
            return _MADE_BY[kind](given)
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
        return LOST
    return made


def _fields(wanted, defaults, values, where, faults):
    """Values by field; what is not given is its default, else None."""
    odd = [key for key in values if key not in wanted]
    _say_odd(odd, "field", wanted, where, faults)
    found = {}
    for name, kind in wanted.items():
        if name in values:
            found[name] = decoded(values[name], kind, f"{where}.{name}", faults)
        elif name in defaults or fits(None, kind):
            found[name] = defaults.get(name)
        else:
            faults.append(f"{where}: {name} is missing")
            found[name] = LOST
    return LOST if odd or any(item is LOST for item in found.values()) else found


def _say_odd(odd, what, among, where, faults):
    """Keys that have no place there, the first of them in full."""
    faults += [f"{where}: {no_such(what, key, among)}" for key in odd[:_MOST_FAULTS]]
    if len(odd) > _MOST_FAULTS:
        faults.append(f"{where}: there are {len(odd) - _MOST_FAULTS} more keys that have no place there")


def _builder(value, where, faults):
    odd = [key for key in value if key not in ("type", "gravity", *ROWS)]
    _say_odd(odd, "table", ["gravity", *ROWS], where, faults)
    if "gravity" not in value:
        faults.append(f"{where}: gravity is missing")
    gravity = decoded(value.get("gravity", [0.0, 0.0, 0.0]), jnp.ndarray, f"{where}.gravity", faults)
    builder, before = SystemBuilder(np.zeros(3) if gravity is LOST else gravity), len(faults)
    for name in ROWS:
        rows = value.get(name, {})
        if not isinstance(rows, dict):
            faults.append(f"{where}.{name}: it must be a mapping of names")
            continue
        kind, table = ROWS[name], getattr(builder.declared, name)
        for key, row in rows.items():
            if len(faults) > _MOST_FAULTS:
                return LOST
            at = f"{where}.{name}.{key}"
            if isinstance(row, dict) and row.get("name", key) != key:
                faults.append(f"{at}: it calls itself {_short(row['name'])}")
            made = record(kind, {**row, "name": key}, at, faults) if isinstance(row, dict) else LOST
            if not isinstance(row, dict):
                faults.append(f"{at}: it must be a mapping")
            if made is not LOST:
                table[key] = made
    if len(faults) == before:
        faults += [f"{where}: {fault}" for fault in builder.faults()]
    return builder if len(faults) == before else LOST
