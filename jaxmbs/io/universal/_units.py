"""Units of a function's axes: by their labels, else by the units of the file (data set 164), else SI."""

import re
from typing import NamedTuple

import numpy as np

from ...linear._transfer import KINDS
from .._numbers import real
from ._data_sets import DataSet
from ._functions import AxisRecord, FunctionError

_POWERS = (("", "receptance"), ("/s", "mobility"), ("/s^2", "accelerance"), ("/s/s", "accelerance"))
_LENGTHS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "in": 0.0254, "inch": 0.0254, "ft": 0.3048}
_ANGLES = {"rad": 1.0, "deg": np.pi / 180, "mrad": 1e-3}
_GRAVITY = 9.80665
_FORCES = {"n": 1.0, "kn": 1e3, "lbf": 4.4482216152605, "lb": 4.4482216152605, "kgf": _GRAVITY, "dyn": 1e-5}
_MOMENTS = {"nm": 1.0, "knm": 1e3, "nmm": 1e-3, "lbfin": 0.1129848290276167, "lbfft": 1.3558179483314004}
_HERTZ = {"hz": 1.0, "khz": 1e3, "1/s": 1.0, "cps": 1.0, "rad/s": 0.5 / np.pi, "rpm": 1 / 60, "cpm": 1 / 60}
_CODES = {8: "receptance", 11: "mobility", 12: "accelerance"}
_FORCE_CODES, _UNKNOWN_CODES, _FREQUENCY = (9, 13), (0, 1), 18
_TYPES = {
    **{2: "stress", 3: "strain", 5: "temperature", 6: "heat flux", 8: "displacement", 9: "reaction force"},
    **{11: "velocity", 12: "acceleration", 13: "force", 15: "pressure", 16: "mass", 17: "time", 18: "frequency"},
    **{19: "rpm", 20: "order", 0: "unknown", 1: "general"},
}


def _motions(lengths):
    return {unit + tail: (kind, size) for unit, size in lengths.items() for tail, kind in _POWERS}


_LINEAR = _motions(_LENGTHS) | dict.fromkeys(("g", "gn"), ("accelerance", _GRAVITY))
_ANGULAR = _motions(_ANGLES)


class FileUnits(NamedTuple):
    """A unit of length [m] and of force [N] of a file."""

    length: float = 1.0
    force: float = 1.0


def file_units(data: DataSet) -> FileUnits:
    """Units of a data set 164, whose factors divide the file's numbers to make SI.  Raises: FunctionError."""
    words = " ".join(data.lines[1:]).upper().replace("D", "E").split()
    try:
        length, force = (1.0 / real(word) for word in words[:2])
    except (ValueError, ZeroDivisionError):
        raise FunctionError(f"{data.place}: its factors of length and force cannot be read") from None
    if not (np.isfinite(length) and np.isfinite(force) and length > 0 and force > 0):
        raise FunctionError(f"{data.place}: its factors of length and force must be positive")
    return FileUnits(length, force)


def frequency_unit(axis: AxisRecord, assumed: bool) -> float:
    """The unit of an abscissa [Hz].  Raises: FunctionError where it is no frequency."""
    if axis.type not in (_FREQUENCY, *_UNKNOWN_CODES):
        raise FunctionError(f"its abscissa is of the type {_axis_name(axis)}, no frequency")
    if not axis.units:
        if axis.type in _UNKNOWN_CODES and not assumed:
            raise FunctionError('its abscissa is of an unknown type; kind="accelerance" or another says what it is')
        return 1.0
    if _normalise_label(axis.units) not in _HERTZ:
        raise FunctionError(f"its frequencies are in {axis.units!r}; Hz, kHz, rad/s, rpm are read")
    return _HERTZ[_normalise_label(axis.units)]


def response_unit(
    axes: tuple[AxisRecord, AxisRecord, AxisRecord], turns: tuple[bool, bool], units: FileUnits, kind: str | None
) -> tuple[str, float]:
    """Kind of a function, and the SI unit of its values.

    Args:
        turns: whether response and reference are rotations; kind: what the user says that an unknown ordinate is.

    Raises: FunctionError for an ordinate that is no motion, a denominator that is no force, unknown units.
    """
    ordinate, below = axes[1], axes[2]
    motions, forces = _ANGULAR if turns[0] else _LINEAR, _MOMENTS if turns[1] else _FORCES
    label, per = _split_units(ordinate.units, motions, forces)
    if label and label not in motions:
        raise FunctionError(f"its ordinate is in {ordinate.units!r}, which is no unit of {_expected_unit(turns[0])}")
    said = [_CODES.get(ordinate.type), motions[label][0] if label else None]
    if ordinate.type not in (*_CODES, *_UNKNOWN_CODES):
        raise FunctionError(f"its ordinate is {_axis_name(ordinate)}, no displacement, velocity or acceleration")
    found = set(filter(None, [*said, kind]))
    if len(found) > 1:
        raise FunctionError(f"its ordinate is said to be {' and '.join(sorted(found))}")
    if not found:
        raise FunctionError(f"its ordinate is {_axis_name(ordinate)}: kind= says which of {', '.join(KINDS)} it is")
    size = motions[label][1] if label else (1.0 if turns[0] else units.length)
    return found.pop(), size / _force(below, per, turns[1], forces, units, kind is not None)


def _force(axis, per, turns, forces, units, assumed):
    label = _normalise_label(axis.units)
    if axis.type not in (*_FORCE_CODES, *_UNKNOWN_CODES):
        raise FunctionError(f"its denominator is {_axis_name(axis)}, no force")
    if label and label not in forces:
        raise FunctionError(
            f"its denominator is in {axis.units!r}, which is no unit of {'moment' * turns or 'force'}"
        )
    if label and per and forces[label] != forces[per]:
        raise FunctionError(f"its ordinate is per {per!r}, its denominator in {axis.units!r}")
    if axis.type in _UNKNOWN_CODES and not (label or per or assumed):
        raise FunctionError("its denominator is unknown: kind= says that it is a force")
    if label or per:
        return forces[label or per]
    return units.force * (units.length if turns else 1.0)


def _split_units(text, motions, forces):
    """Unit of the motion, and that of the force where the label has both: "(m/s^2)/N"."""
    label = _normalise_label(text)
    head, _, tail = label.rpartition("/")
    if label not in motions and tail in forces and head in motions:
        return head, tail
    return label, ""


def _normalise_label(text):
    """A label in lower case without brackets, blanks and the many ways to write a power or a product."""
    text = text.strip().lower().replace("²", "^2").replace("µ", "u").replace("μ", "u").replace("**", "^")
    text = re.sub(r"[()\[\]\s·*_]|(?<=[a-z])[.-](?=[a-z])", "", text)
    return re.sub(r"s(?:ec)?\^?2", "s^2", re.sub(r"(?<=/)sec(?!\w)", "s", text))


def _expected_unit(turns):
    return "rotation" if turns else "displacement, velocity or acceleration"


def _axis_name(axis):
    return _TYPES.get(axis.type, f"of the type {axis.type}")
