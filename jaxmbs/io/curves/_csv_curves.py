"""Curves in comma-separated files: one line of names with units, then numbers."""

import csv
import io
import re
from os import PathLike

import numpy as np

from .._numbers import real
from .._regular_file import read_bytes
from ._table import AXES, MOST_FAULTS, CurveTable

_MOST_BYTES = 2_000_000_000
_NAMED = re.compile(r"^(.*?)\s*(?:\[([^\]]*)\])?$")
_EXAMPLE = "`time [s], bolt x [N]` or `frequency [Hz], level [g^2/Hz]`"


def csv_curves(path: str | PathLike, faults: list[str]) -> CurveTable | None:
    """Columns of a file; what is wrong with it is added to the faults."""
    try:
        text = read_bytes(path, _MOST_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        faults.append(f"it is no text in UTF-8: byte {error.start}")
        return None
    numbered = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip() and line[0] != "#"]
    if not numbered:
        faults.append(f"it is empty: its first line must be like {_EXAMPLE}")
        return None
    first, head = numbered[0]
    separator = next((mark for mark in ";\t" if mark in head), ",")
    cells = [
        [cell.strip() for cell in row] for row in csv.reader([line for _, line in numbered], delimiter=separator)
    ]
    names, units = _header(cells[0], first, faults)
    if names is None:
        return None
    rows, lines = _numbers(numbered[1:], cells[1:], names, faults)
    if not rows:
        faults.append("it has no numbers below its first line")
        return None
    values = np.array(rows)
    quantity = names[0].lower()
    return CurveTable(values[:, 0], values[:, 1:], quantity, units[0], tuple(names[1:]), tuple(units[1:]), lines)


def _header(cells, line, faults):
    """Names and units of the columns, or None."""
    if all(_is_number(cell) for cell in cells):
        faults.append(f"line {line}: names and units are missing: it must be like {_EXAMPLE}")
        return None, None
    named = [_NAMED.match(cell).groups() for cell in cells]
    names, units = [name for name, _ in named], [(unit or "").strip() for _, unit in named]
    if names[0].lower() not in AXES:
        faults.append(f"line {line}: the first column is {names[0]!r}, not time or frequency: {_EXAMPLE}")
    faults += [f"line {line}: column {k + 1} has no name" for k, name in enumerate(names) if not name]
    if len(names) < 2:
        faults.append(f"line {line}: one column alone: {_EXAMPLE}")
    return (None, None) if faults else (names, units)


def _numbers(numbered, cells, names, faults):
    """Rows of numbers and where they stand; faults of the lines, not more than fit a report."""
    rows, lines = [], []
    for (line, _), row in zip(numbered, cells, strict=True):
        wrong = [(name, cell) for name, cell in zip(names, row, strict=False) if not _is_number(cell)]
        if len(row) != len(names):
            faults.append(f"line {line}: it has {len(row)} columns, the first line {len(names)}")
        faults += [f"line {line}: {name!r} is {cell[:32]!r}, no number" for name, cell in wrong]
        if len(faults) > MOST_FAULTS:
            faults[MOST_FAULTS:] = ["and more"]
            break
        if not wrong and len(row) == len(names):
            rows.append([real(cell) for cell in row])
            lines.append(f"line {line}")
    return rows, tuple(lines)


def _is_number(cell):
    try:
        real(cell)
    except ValueError:
        return False
    return True


def csv_text(table: CurveTable, faults: list[str]) -> str:
    """Text of a file, numbers in full."""
    for name, unit in zip(table.names, table.units, strict=True):
        if (
            not name
            or name != name.strip()
            or not name.isprintable()
            or set("[]") & set(name + unit)
            or name[0] == "#"
        ):
            faults.append(f"the name {name!r} [{unit}] is blank, or has brackets, or blanks around it")
    if faults:
        return ""
    heads = [f"{table.quantity} [{table.axis_unit}]"]
    heads += [f"{name} [{unit}]" if unit else name for name, unit in zip(table.names, table.units, strict=True)]
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(heads)
    writer.writerows(
        [repr(x), *map(repr, row)] for x, row in zip(table.axis.tolist(), table.values.tolist(), strict=True)
    )
    return out.getvalue()
