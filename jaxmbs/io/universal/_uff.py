"""Transfer functions in Universal File Format, data set 58."""

import collections
import re
from collections.abc import Sequence
from os import PathLike

import numpy as np

from ...atomic_write import atomic_file
from ...elements import DIRECTIONS
from ...errors import ModelError, ModelFileError, warn
from ...linear._transfer import KINDS, TransferFunctions
from .._regular_file import read_bytes
from ._data_sets import data_sets
from ._functions import FUNCTIONS, TRANSFER, FunctionError, FunctionRecord, function_type, parse_function
from ._units import FileUnits, file_units, frequency_unit, response_unit

_CODES = {"receptance": 8, "mobility": 11, "accelerance": 12}  # data types of displacement, velocity, acceleration
_FORCE, _FREQUENCY = 13, 18
_NAMED = re.compile(r"^(output|input) (.+)$")
_MOST_BYTES, _MOST_FAULTS = 2_000_000_000, 50
_IGNORED_SILENTLY = (151, 164)  # header and units


def write_uff(path: str | PathLike, transfer: TransferFunctions) -> None:
    """One data set for each pair (output, input); frequencies in Hz, to six digits, values to twelve.

    A channel "12 -rx" is node 12, direction -4; others are numbered in their order.  ID lines 4 and 5 hold the names
    in full.  Units are not in the file: numbers stand as they are.

    Raises: ModelError for names that a line cannot hold, numbers that are not finite, and frequencies that do not
    ascend in six digits, all in one report; OSError where the file cannot be written.
    """
    places = _nodes([*transfer.outputs, *transfer.inputs])
    x, values = np.asarray(transfer.omega, float) / (2 * np.pi), np.asarray(transfer.values)
    faults = [fault for name in places if (fault := _unwritable(name))]
    if not np.all(np.isfinite(x)) or np.any(np.diff([float(f"{f:.5e}") for f in x]) <= 0):
        faults.append("the frequencies are not finite, or do not ascend in the six digits that the format has")
    for i, j in np.argwhere(~np.all(np.isfinite(values), axis=0))[:_MOST_FAULTS].tolist():
        count = int(np.sum(~np.isfinite(values[:, i, j])))
        faults.append(f"{transfer.outputs[i]} by {transfer.inputs[j]} is not finite at {count} frequencies")
    if faults:
        raise ModelError(faults, "the transfer function")
    with atomic_file(path) as file:
        for i, output in enumerate(transfer.outputs):
            for j, driven in enumerate(transfer.inputs):
                axes = [(_FREQUENCY, "Hz"), (_CODES[transfer.kind], "NONE"), (_FORCE, "NONE"), (0, "NONE")]
                names = [transfer.kind, "NONE", "NONE", f"output {output}", f"input {driven}"]
                file.write(_header(names, places[output], places[driven], len(x), axes))
                file.writelines(
                    f"{f:13.5e}{v.real:20.12e}{v.imag:20.12e}\n" for f, v in zip(x, values[:, i, j], strict=True)
                )
                file.write("    -1\n")


def _header(names, output, driven, count, axes):
    """Eleven lines and the two before them: complex numbers in double precision, at frequencies of their own."""
    places = "".join(f" {'NONE':<10}{node:10d}{direction:4d}" for node, direction in (output, driven))
    lines = ["    -1", f"{58:6d}", *names, f"{TRANSFER:5d}{0:10d}{0:5d}{0:10d}{places}"]
    lines.append(f"{6:10d}{count:10d}{0:10d}{0.0:13.5e}{0.0:13.5e}{0.0:13.5e}")
    lines += [f"{code:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20} {units:<20}" for code, units in axes]
    return "".join(f"{line:<80}\n" for line in lines)


def _unwritable(name):
    if len(name) > 70:
        return f"channel name {name!r} is longer than 70 characters"
    if not name.isprintable() or name != name.strip() or not name:
        return f"channel name {name!r} is blank, or has blanks around it or characters that are not printed"
    return None


def read_uff(path: str | PathLike, kind: str | None = None) -> TransferFunctions:
    """All transfer functions of a file, text or binary, as a matrix; channels by their full names, else "node
    direction"; in SI.

    Units are those of the axes' labels, else those of the file (data set 164), else SI.  Coherences, spectra and
    whatever else is no frequency response function is left out with a warning.

    Args:
        kind: "receptance", "mobility" or "accelerance": what functions are, per force and over frequencies, whose
            axes say "unknown" or "general"; what the file says otherwise stays a fault.

    Raises: ModelFileError with every fault: no transfer functions, data sets that are cut off, ordinates that are no
    motion, denominators that are no force, unknown units, missing or repeated pairs, different frequencies or kinds;
    ValueError for an unknown `kind`.
    """
    if kind not in (None, *KINDS):
        raise ValueError(f"kind {kind!r} is none of {', '.join(KINDS)}")
    faults: list[str] = []
    functions, kinds, others = _functions(read_bytes(path, _MOST_BYTES), kind, faults)
    if not functions and not faults:
        had = f": it has {_count_functions(others)}" if others else ""
        faults.append(f"it has no transfer functions (data set 58, function type 4){had}")
    pairs = [(_channel(f, "output"), _channel(f, "input")) for f in functions]
    outputs, inputs = (list(dict.fromkeys(pair[k] for pair in pairs)) for k in (0, 1))
    faults = faults or _faults(functions, kinds, pairs, outputs, inputs)
    if faults:
        more = [f"and {len(faults) - _MOST_FAULTS} more"] if len(faults) > _MOST_FAULTS else []
        raise ModelFileError(path, faults[:_MOST_FAULTS] + more)
    if others:
        warn(f"{path}: left out: {_count_functions(others)}")
    values = np.zeros((len(functions[0].x), len(outputs), len(inputs)), complex)
    for data, (output, driven) in zip(functions, pairs, strict=True):
        values[:, outputs.index(output), inputs.index(driven)] = data.values
    return TransferFunctions(2 * np.pi * functions[0].x, values, outputs, inputs, kinds[0])


def _functions(content, kind, faults):
    """Functions in SI over Hz, their kinds, and how often the file has what else."""
    functions: list[FunctionRecord] = []
    kinds: list[str] = []
    others: collections.Counter = collections.Counter()
    units = FileUnits()
    for data in data_sets(content, faults):
        try:
            if data.number == 164:
                units = file_units(data)
            elif data.number != 58:
                others.update([] if data.number in _IGNORED_SILENTLY else [f"data set {data.number}"])
            elif (one := function_type(data)) != TRANSFER:
                others[FUNCTIONS[one] if 0 <= one < len(FUNCTIONS) else f"function of type {one}"] += 1
            else:
                found, its_kind = _in_si(parse_function(data), units, kind)
                functions.append(found)
                kinds.append(its_kind)
        except FunctionError as error:
            faults.append(str(error))
    return functions, kinds, others


def _in_si(data, units, kind):
    try:
        if any(abs(direction) > 6 for _, direction in (data.response, data.reference)):
            raise FunctionError("a direction is none of -6 to 6")
        turns = abs(data.response[1]) > 3, abs(data.reference[1]) > 3
        its_kind, size = response_unit(data.axes, turns, units, kind)
        x = data.x * frequency_unit(data.axes[0], kind is not None)
        if np.any(np.diff(x) <= 0):
            raise FunctionError("its frequencies do not ascend")
        if not data.is_complex and not np.any(data.values.real < 0):
            raise FunctionError("its values are real and none is negative: magnitudes, without their phases")
    except FunctionError as error:
        raise FunctionError(
            f"{data.place}, {_channel(data, 'output')} by {_channel(data, 'input')}: {error}"
        ) from None
    return data._replace(x=x, values=size * data.values), its_kind


def _count_functions(others):
    return ", ".join(f"{count} x {name}" for name, count in others.items())


def _faults(functions, kinds, pairs, outputs, inputs):
    count = collections.Counter(pairs)
    faults = [f"{a} by {b} stands {n} times in the file" for (a, b), n in count.items() if n > 1]
    faults += [f"{a} by {b} is missing" for a in outputs for b in inputs if (a, b) not in count]
    for data, kind, (a, b) in zip(functions, kinds, pairs, strict=True):
        x = functions[0].x
        if len(data.x) != len(x) or not np.allclose(data.x, x, rtol=1e-5):
            faults.append(f"{a} by {b} is at other frequencies than the first one")
        if kind != kinds[0]:
            faults.append(f"{a} by {b} is of another kind than the first one ({kind}, not {kinds[0]})")
    return faults


def _channel(data, side):
    named = _NAMED.match(data.lines[3 if side == "output" else 4].strip())
    if named and named[1] == side:
        return named[2]
    node, direction = data.response if side == "output" else data.reference
    name = f"{'-' if direction < 0 else ''}{DIRECTIONS[abs(direction) - 1]}" if 1 <= abs(direction) <= 6 else ""
    return f"{node} {name}".strip()


def _nodes(names: Sequence[str]) -> dict[str, tuple[int, int]]:
    """Node number and direction code (+-1 to 6, 0 scalar) of each channel."""
    split = {}
    for name in names:
        node, _, direction = name.rpartition(" ")
        known = node and direction.lstrip("-+") in DIRECTIONS
        split[name] = (node, direction) if known else (name, "")
    nodes = list(dict.fromkeys(node for node, _ in split.values()))
    own = all(re.fullmatch("[0-9]{1,10}", node) for node in nodes)
    numbers = {node: int(node) if own else k for k, node in enumerate(nodes, start=1)}
    places = {}
    for name, (node, direction) in split.items():
        code = DIRECTIONS.index(direction.lstrip("-+")) + 1 if direction else 0
        places[name] = (numbers[node], -code if direction.startswith("-") else code)
    return places
