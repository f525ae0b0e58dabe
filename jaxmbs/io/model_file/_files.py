"""Model files written and read: JSON of version 1."""

import collections
import json
import os
from pathlib import Path
from typing import Any

from ...assembly._state import State
from ...atomic_write import atomic_file
from ...errors import ModelError, ModelFileError
from ...model._system import System
from .._regular_file import read_bytes
from ._decode import INVALID, decode
from ._encode import encode

VERSION = 1
MOST_BYTES = 1_000_000_000
_WIDTH = 118
_MOST_FAULTS = 100


def save_model(model: Any, path: str | os.PathLike) -> None:
    """Write a model as readable JSON; `load_model` returns exactly the same numbers.

    Args:
        model: a `SystemBuilder` with all that was declared; or joints, laws, elements, a `Structure`, reductions,
            `LinearSystem`, limits: whatever the library declares by classes, and dicts and tuples of such.
        path: of the file, which is there as a whole or not at all.

    Functions are written by the name that `mbs.io.register` gave them.

    Raises: ModelError for a built `System` (give the builder), a builder with faults, traced numbers, functions and
    classes without a name, all in one report; OSError where the file cannot be written.
    """
    if isinstance(model, System):
        raise ModelError(["a built System cannot be saved: give save_model the builder that it was built from"])
    if isinstance(model, State):
        raise ModelError(["a State cannot be saved: save the builder, and the coordinates by joint beside it"])
    faults: list[str] = []
    content = encode(model, "model", faults)
    if faults:
        raise ModelError(faults)
    with atomic_file(path) as file:
        file.write(_pretty({"jaxmbs model": VERSION, "model": content}) + "\n")


def load_model(path: str | os.PathLike) -> Any:
    """Load a model that `save_model` wrote: a `SystemBuilder` or another object.  No code of the file is run.

    Raises: ModelFileError with every fault: no model file, of a later version, unknown types, fields and names,
    values that cannot be, functions that are not registered, and what `build` would say.
    """
    path = Path(path)
    document = _parse_json(path, read_bytes(path, MOST_BYTES))
    version = document.get("jaxmbs model") if isinstance(document, dict) else None
    if type(version) is not int:
        raise ModelFileError(path, ['it is not a model file: it does not begin with "jaxmbs model"'])
    if version != VERSION:
        raise ModelFileError(path, [_version_fault(version)])
    beside = [key for key in document if key not in ("jaxmbs model", "model")]
    faults = [f"there is {', '.join(map(repr, beside[:10]))} beside the model"] if beside else []
    faults += [] if "model" in document else ["it has no model"]
    try:
        found = decode(document.get("model"), Any, "model", faults)
    except RecursionError as error:
        raise ModelFileError(path, ["its values are nested too deep"]) from error
    if faults or found is INVALID:
        more = [f"and {len(faults) - _MOST_FAULTS} more"] if len(faults) > _MOST_FAULTS else []
        raise ModelFileError(path, faults[:_MOST_FAULTS] + more)
    return found


def _version_fault(version):
    way = "a later release reads it" if version > VERSION else "no release wrote it"
    return f"it is of version {version}; this release reads version {VERSION}: {way}"


def _parse_json(path, content):
    def unique(pairs):
        found = dict(pairs)
        if len(found) < len(pairs):
            names = [name for name, _ in pairs]
            twice = [name for name, count in collections.Counter(names).items() if count > 1]
            raise ValueError(f"{', '.join(map(repr, twice[:10]))} {'is' if len(twice) == 1 else 'are'} defined twice")
        return found

    def no_constant(word):
        raise ValueError(f"{word} is not JSON; write it as a string")

    try:
        return json.loads(content.decode("utf-8-sig"), object_pairs_hook=unique, parse_constant=no_constant)
    except (ValueError, RecursionError) as error:  # among them what is no UTF-8
        raise ModelFileError(path, [f"it is not readable JSON: {error}"]) from error


def _pretty(value, indent: int = 0) -> str:
    """JSON with what fits on a line on one line, else an entry to a line."""
    flat = json.dumps(value, ensure_ascii=False, allow_nan=False)
    if len(flat) + indent <= _WIDTH or not isinstance(value, dict | list) or not value:
        return flat
    inner = " " * (indent + 1)
    if isinstance(value, dict):
        rows = [f"{inner}{json.dumps(k, ensure_ascii=False)}: {_pretty(v, indent + 1)}" for k, v in value.items()]
        return "{\n" + ",\n".join(rows) + "\n" + " " * indent + "}"
    rows = [inner + _pretty(item, indent + 1) for item in value]
    return "[\n" + ",\n".join(rows) + "\n" + " " * indent + "]"
