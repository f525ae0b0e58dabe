"""Curves in universal files: real functions of data sets 58 over a common axis."""

from os import PathLike

import numpy as np

from .._regular_file import read_bytes
from ..universal._data_sets import data_sets
from ..universal._functions import FUNCTIONS, FunctionError, function_type, parse_function
from ..universal._uff import _channel
from ._table import MOST_FAULTS, CurveTable

_MOST_BYTES = 2_000_000_000
_TIME, _FREQUENCY = 17, 18
_HISTORY, _AUTO, _PSD, _SPECTRUM, _SHOCK = 1, 2, 9, 12, 24
_AXES = {_TIME: ("time", "s"), _FREQUENCY: ("frequency", "Hz")}


def uff_curves(path: str | PathLike, faults: list[str]) -> CurveTable | None:
    """Real functions of a file: time responses, or spectra; what is wrong with it is added to the faults."""
    functions = []
    for data in data_sets(read_bytes(path, _MOST_BYTES), faults):
        try:
            if data.number == 58 and function_type(data) in (_HISTORY, _AUTO, _PSD, _SPECTRUM, _SHOCK):
                functions.append(parse_function(data))
        except FunctionError as error:
            faults.append(str(error))
    if not functions and not faults:
        kinds = ", ".join(FUNCTIONS[k] for k in (_HISTORY, _AUTO, _PSD, _SPECTRUM, _SHOCK))
        faults.append(f"it has no curves: data sets 58 of the kinds {kinds} are read")
    faults += [fault for one in functions for fault in _faults(one, functions[0])][:MOST_FAULTS]
    if faults:
        return None
    quantity, unit = _AXES[functions[0].axes[0].type]
    unit = functions[0].axes[0].units or unit
    names = tuple(_channel(one, "output") for one in functions)
    values = np.stack([one.values.real for one in functions], axis=1)
    return CurveTable(
        functions[0].x, values, quantity, unit, names, tuple(one.axes[1].units for one in functions), ()
    )


def _faults(one, first):
    if one.is_complex:
        yield f"{one.place}: its values are complex: curves are real"
    if one.axes[0].type not in _AXES:
        yield f"{one.place}: its abscissa is of the type {one.axes[0].type}, neither time (17) nor frequency (18)"
    elif one.axes[0] != first.axes[0]:
        yield f"{one.place}: its abscissa is another one than that of {first.place}"
    elif len(one.x) != len(first.x) or not np.allclose(one.x, first.x, rtol=1e-5):
        yield f"{one.place}: its points are others than those of {first.place}"


def uff_text(table: CurveTable, faults: list[str]) -> str:
    """Text of a file: one data set for each curve, even points by their first one and their distance."""
    for name, unit in zip(table.names, table.units, strict=True):
        if len(name) > 70 or not name.isprintable() or name != name.strip() or not name:
            faults.append(f"the name {name!r} is blank, longer than 70 characters, or has blanks around it")
        if len(unit) > 20 or not unit.isascii():
            faults.append(f"the unit {unit!r} of {name!r} is longer than 20 ASCII characters")
    six = np.array([float(f"{x:.5e}") for x in table.axis])
    first, step = table.axis[0], (table.axis[-1] - table.axis[0]) / (len(table.axis) - 1)
    even = np.allclose(table.axis, first + step * np.arange(len(six)), rtol=0, atol=1e-6 * step)
    if not even and np.any(np.diff(six) <= 0):
        faults.append("the axis does not rise in the six digits that the format has")
    if faults:
        return ""
    return "".join(_data_set(table, k, (first, step) if even else None) for k in range(len(table.names)))


def _data_set(table, k, even):
    unit = table.units[k]
    kind = _HISTORY if table.quantity == "time" else _PSD if unit.lower().endswith("/hz") else _SPECTRUM
    axis = next(code for code, (name, _) in _AXES.items() if name == table.quantity)
    lines = ["    -1", f"{58:6d}", "curve", "NONE", "NONE", f"output {table.names[k]}", "NONE"]
    places = f" {'NONE':<10}{k + 1:10d}{0:4d}" + f" {'NONE':<10}{0:10d}{0:4d}"
    lines.append(f"{kind:5d}{0:10d}{0:5d}{0:10d}{places}")
    start, step = even or (0.0, 0.0)
    lines.append(f"{4:10d}{len(table.axis):10d}{int(even is not None):10d}{start:13.5e}{step:13.5e}{0.0:13.5e}")
    for code, label in ((axis, table.axis_unit), (0, unit or "NONE"), (0, "NONE"), (0, "NONE")):
        lines.append(f"{code:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20} {label:<20}")
    values = table.values[:, k]
    if even:
        numbers, width = [f"{y:20.12e}" for y in values], 4
    else:
        numbers, width = [f"{x:13.5e}{y:20.12e}" for x, y in zip(table.axis, values, strict=True)], 2
    rows = ["".join(numbers[i : i + width]) for i in range(0, len(numbers), width)]
    return "".join(f"{line:<80}\n" for line in [*lines, *rows, "    -1"])
