"""Transfer functions in Universal File Format, data set 58 (pyuff reads and writes it)."""

import re
from collections.abc import Sequence
from os import PathLike
from typing import Any

import numpy as np

from ..elements import DIRECTIONS
from ..errors import ModelError
from ..linear.transfer import KINDS, TransferFunctions

_CODES = {"receptance": 8, "mobility": 11, "accelerance": 12}  # data types of displacement, velocity, acceleration
_FORCE, _FREQUENCY, _TRANSFER = 13, 18, 4
_NAMED = re.compile(r"^(?:output|input) (.+)$")


def write_uff(path: str | PathLike, transfer: TransferFunctions) -> None:
    """One data set for each pair (output, input); frequencies in Hz, to six digits, values to twelve.

    A channel "12 -rx" is node 12, direction -4; others are numbered in their order.  ID lines 4 and 5 hold the names
    in full.

    Raises: ModelError for names that are longer than 70 characters; ImportError without pyuff (the extra `io`).
    """
    pyuff = _pyuff()
    long = [name for name in {*transfer.outputs, *transfer.inputs} if len(name) > 70]
    if long:
        raise ModelError([f"channel name {name!r} is longer than 70 characters" for name in sorted(long)])
    places = _nodes([*transfer.outputs, *transfer.inputs])
    hertz, values = np.asarray(transfer.omega, float) / (2 * np.pi), np.asarray(transfer.values)
    sets = []
    for i, output in enumerate(transfer.outputs):
        for j, driven in enumerate(transfer.inputs):
            (rsp_node, rsp_dir), (ref_node, ref_dir) = places[output], places[driven]
            data: dict[str, Any] = dict(type=58, func_type=_TRANSFER, rsp_node=rsp_node, rsp_dir=rsp_dir)
            data |= dict(ref_node=ref_node, ref_dir=ref_dir, x=hertz, data=values[:, i, j].astype(complex))
            data |= dict(id1=transfer.kind, id4=f"output {output}", id5=f"input {driven}", abscissa_spacing=0)
            data |= dict(abscissa_spec_data_type=_FREQUENCY, ordinate_spec_data_type=_CODES[transfer.kind])
            data |= dict(orddenom_spec_data_type=_FORCE, z_axis_spec_data_type=0, abscissa_axis_units_lab="Hz")
            sets.append(data)
    pyuff.UFF(str(path)).write_sets(sets, mode="overwrite")


def read_uff(path: str | PathLike) -> TransferFunctions:
    """All transfer functions of a file, as a matrix; channels by their full names, else "node direction".

    Raises: ModelError with what is wrong: no transfer functions, missing or repeated pairs, different frequencies or
    kinds; ImportError without pyuff.
    """
    found = _pyuff().UFF(str(path)).read_sets()
    found = [found] if isinstance(found, dict) else found
    sets = [s for s in found if s.get("type") == 58 and s.get("func_type") == _TRANSFER]
    if not sets:
        raise ModelError([f"{path} has no transfer functions (data set 58, function type 4)"])
    pairs = [(_channel(s, "rsp", "id4", "output"), _channel(s, "ref", "id5", "input")) for s in sets]
    outputs, inputs = (list(dict.fromkeys(pair[k] for pair in pairs)) for k in (0, 1))
    faults = _faults(sets, pairs, outputs, inputs)
    if faults:
        raise ModelError(faults)
    values = np.zeros((len(sets[0]["x"]), len(outputs), len(inputs)), complex)
    for data, (output, driven) in zip(sets, pairs, strict=True):
        values[:, outputs.index(output), inputs.index(driven)] = data["data"]
    codes = {code: kind for kind, code in _CODES.items()}
    kind = codes.get(sets[0]["ordinate_spec_data_type"], KINDS[0])
    return TransferFunctions(2 * np.pi * np.asarray(sets[0]["x"]), values, outputs, inputs, kind)


def _faults(sets, pairs, outputs, inputs):
    count = {pair: pairs.count(pair) for pair in pairs}
    faults = [f"{a} by {b} stands {n} times in the file" for (a, b), n in count.items() if n > 1]
    faults += [f"{a} by {b} is missing" for a in outputs for b in inputs if (a, b) not in count]
    first = sets[0]
    for data, (a, b) in zip(sets, pairs, strict=True):
        if len(data["x"]) != len(first["x"]) or not np.allclose(data["x"], first["x"], rtol=1e-5):
            faults.append(f"{a} by {b} is at other frequencies than the first one")
        if data["ordinate_spec_data_type"] != first["ordinate_spec_data_type"]:
            faults.append(f"{a} by {b} is of another kind than the first one")
    return faults


def _channel(data, side, line, what):
    named = _NAMED.match(str(data.get(line, "")).strip())
    if named and str(data[line]).startswith(what):
        return named[1]
    direction = data[f"{side}_dir"]
    name = f"{'-' if direction < 0 else ''}{DIRECTIONS[abs(direction) - 1]}" if 1 <= abs(direction) <= 6 else ""
    return f"{data[f'{side}_node']} {name}".strip()


def _nodes(names: Sequence[str]) -> dict[str, tuple[int, int]]:
    """Node number and direction code (+-1 to 6, 0 scalar) of each channel."""
    split = {}
    for name in names:
        node, _, direction = name.rpartition(" ")
        known = node and direction.lstrip("-+") in DIRECTIONS
        split[name] = (node, direction) if known else (name, "")
    nodes = list(dict.fromkeys(node for node, _ in split.values()))
    numbers = {n: int(n) if all(m.isdigit() for m in nodes) else k for k, n in enumerate(nodes, start=1)}
    places = {}
    for name, (node, direction) in split.items():
        code = DIRECTIONS.index(direction.lstrip("-+")) + 1 if direction else 0
        places[name] = (numbers[node], -code if direction.startswith("-") else code)
    return places


def _pyuff():
    try:
        import pyuff
    except ImportError as error:
        raise ImportError("UFF files need pyuff: pip install 'jaxmbs[io]'") from error
    return pyuff
