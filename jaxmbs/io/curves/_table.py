"""Numbers of a file as columns over an axis, before units and faults are judged."""

import re
from typing import NamedTuple

import numpy as np

from ...checks import repeated

#: Units of both axes in SI.
AXES = {"time": {"s": 1.0, "ms": 1e-3}, "frequency": {"Hz": 1.0, "kHz": 1e3}}
MOST_FAULTS = 50


class CurveTable(NamedTuple):
    """Columns over an axis; lines: (points,) where each point stands, as "line 7"."""

    axis: np.ndarray
    values: np.ndarray
    quantity: str
    axis_unit: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    lines: tuple[str, ...]


def table_faults(table: CurveTable) -> list[str]:
    """Faults of an axis, of names and of values."""
    faults = []
    if table.axis_unit not in AXES.get(table.quantity, {}):
        known = ", ".join(f"{name} [{unit}]" for name, units in AXES.items() for unit in units)
        faults.append(f"the axis is {table.quantity} [{table.axis_unit}]: it must be one of {known}")
    if len(table.axis) < 2:
        faults.append("it has fewer than two points")
    place = lambda k: table.lines[k] if table.lines else f"point {k + 1}"
    for k in np.flatnonzero(~np.isfinite(table.axis))[:MOST_FAULTS]:
        faults.append(f"{place(k)}: the {table.quantity} is not finite")
    for k in np.flatnonzero(~(np.diff(table.axis) > 0) & np.isfinite(table.axis[1:]))[:MOST_FAULTS] + 1:
        faults.append(f"{place(k)}: the {table.quantity} {table.axis[k]:.6g} does not rise")
    for k, i in np.argwhere(~np.isfinite(table.values))[:MOST_FAULTS]:
        faults.append(f"{place(k)}: {table.names[i]!r} is not finite")
    return faults + [f"two curves are named {name!r}" for name in repeated(table.names)]


def normalise_unit(text: str) -> str:
    """A unit in lower case without blanks and brackets."""
    return re.sub(r"[()\[\]\s*]", "", text.lower().replace("²", "^2"))
