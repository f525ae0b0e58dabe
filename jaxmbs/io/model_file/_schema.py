"""The JSON schema of model files, made from the declarations of the classes themselves."""

import dataclasses
from typing import Any, get_args, get_origin

from ._annotations import alternatives, is_array, matches
from ._registry import ROWS, classes

_NUMBERS = {
    "description": "a number, or nested lists of numbers; 'inf', '-inf', 'nan' for what JSON has no number for",
    "anyOf": [
        {"type": "number"},
        {"enum": ["inf", "-inf", "nan"]},
        {"type": "array", "items": {"$ref": "#/$defs/numbers"}},
        {
            "type": "object",
            "properties": {"real": {"$ref": "#/$defs/numbers"}, "imag": {"$ref": "#/$defs/numbers"}},
            "required": ["real", "imag"],
            "additionalProperties": False,
        },
    ],
}
_FUNCTION = {
    "description": "a function by the name that it is registered under; values bound to its arguments",
    "type": "object",
    "properties": {"function": {"type": "string"}, "arguments": {"type": "array"}, "keywords": {"type": "object"}},
    "required": ["function"],
    "additionalProperties": False,
}
_SIMPLE = {str: "string", bool: "boolean", int: "integer", float: "number", type(None): "null"}


def model_schema() -> dict[str, Any]:
    """The schema (JSON Schema 2020-12) that every file of `save_model` keeps."""
    own = {name: _record(kind) for name, kind in classes().items()}
    tables = {"type": {"const": "SystemBuilder"}, "gravity": {"$ref": "#/$defs/numbers"}}
    for name, row in ROWS.items():
        tables[name] = {"type": "object", "additionalProperties": _record(row, is_row=True)}
    builder = {"type": "object", "properties": tables, "required": ["type", "gravity"], "additionalProperties": False}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "jaxmbs model file, version 1",
        "type": "object",
        "properties": {"jaxmbs model": {"const": 1}, "model": True},
        "required": ["jaxmbs model", "model"],
        "additionalProperties": False,
        "if": {"properties": {"model": {"properties": {"type": {"const": "SystemBuilder"}}, "required": ["type"]}}},
        "then": {"properties": {"model": {"$ref": "#/$defs/SystemBuilder"}}},
        "$defs": {"numbers": _NUMBERS, "function": _FUNCTION, "SystemBuilder": builder, **own},
    }


def _fields(kind):
    """Names, annotations and whether they must be there."""
    if not dataclasses.is_dataclass(kind):
        return [(name, kind.__annotations__.get(name, Any), True) for name in kind._fields]
    return [(f.name, f.type, f.default is f.default_factory is dataclasses.MISSING) for f in dataclasses.fields(kind)]


def _record(kind, is_row=False):
    fields = [row for row in _fields(kind) if not (is_row and row[0] == "name")]
    properties = {} if is_row else {"type": {"const": kind.__name__}}
    properties |= {name: _schema(wanted) for name, wanted, _ in fields}
    needed = [] if is_row else ["type"]
    needed += [name for name, wanted, must in fields if must and not matches(None, wanted)]
    first = (kind.__doc__ or "").strip().partition("\n")[0]
    found = {"description": first, "type": "object", "properties": properties, "additionalProperties": False}
    return {**found, **({"required": needed} if needed else {})}


def _schema(wanted):
    """The schema of an annotation; True, anything, where it says nothing that JSON could show."""
    found = [] if not is_array(wanted) else [{"$ref": "#/$defs/numbers"}]
    for one in alternatives(wanted):
        part = _schema_of_one(one)
        if part is True:
            return True
        if part is not None and part not in found:
            found.append(part)
    return found[0] if len(found) == 1 else {"anyOf": found}


def _schema_of_one(one):
    if one in _SIMPLE:
        return {"type": _SIMPLE[one]}
    if is_array(one):
        return None
    if get_origin(one) is tuple or one in (tuple, list):
        return {"type": "array"}
    if get_origin(one) is dict or one is dict:
        inside = get_args(one)
        return {"type": "object", **({"additionalProperties": _schema(inside[1])} if inside else {})}
    if isinstance(one, type):
        kinds = [name for name, kind in classes().items() if issubclass(kind, one)]
        if kinds:
            return {"anyOf": [{"$ref": f"#/$defs/{name}"} for name in kinds]}
    return True
