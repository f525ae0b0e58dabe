"""Tyre property files (`.tir`): sections of `NAME = value`, comments after `$` or `!`, tables that are left alone."""

import math
import os
import re
from pathlib import Path
from typing import NamedTuple

from ..checks import no_such
from ..errors import ModelFileError, warn
from ._coefficients import ALIASES, ANGLES, DIMENSIONS, KNOWN, NEEDED, PRESSURES, SWITCHES

_MOST_BYTES = 4_000_000
_UNITS = {
    "LENGTH": {"METER": 1.0, "M": 1.0, "MM": 1e-3, "MILLIMETER": 1e-3, "CM": 1e-2, "KM": 1e3, "INCH": 0.0254},
    "FORCE": {
        "NEWTON": 1.0,
        "N": 1.0,
        "KNEWTON": 1e3,
        "KN": 1e3,
        "POUND_FORCE": 4.4482216152605,
        "KG_FORCE": 9.80665,
    },
    "ANGLE": {"RADIAN": 1.0, "RADIANS": 1.0, "RAD": 1.0, "DEGREE": math.pi / 180, "DEGREES": math.pi / 180},
    "TIME": {"SECOND": 1.0, "SEC": 1.0, "S": 1.0, "MILLISECOND": 1e-3, "MINUTE": 60.0, "HOUR": 3600.0},
    "MASS": {"KG": 1.0, "GRAM": 1e-3, "POUND_MASS": 0.45359237, "SLUG": 14.593902937},
    "PRESSURE": {"PASCAL": 1.0, "PA": 1.0, "KPASCAL": 1e3, "KPA": 1e3, "BAR": 1e5, "PSI": 6894.757293168},
}
_UNITS["LENGTH"] |= {"METERS": 1.0, "MILLIMETERS": 1e-3, "IN": 0.0254, "FOOT": 0.3048, "FT": 0.3048}
_UNITS["ANGLE"] |= {"DEG": math.pi / 180}
_FITS = {5: "5.2", 6: "5.2", 21: "5.2", 60: "6.1", 61: "6.1", 62: "6.2"}
_FORMATS = {"PAC2002": "5.2", "MF_05": "5.2"}
_SIDES = {"LEFT": "left", "RIGHT": "right", "SYMMETRIC": "symmetric", "UNKNOWN": "left"}
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*$")
#: Sections whose names concern forces: a number there that no formula reads is told.
_OF_FORCES = ("COEFFICIENT", "SCALING")


class TirFile(NamedTuple):
    """A tyre property file.

    Attributes:
        coefficients: numbers by name, in SI units; zeros are left out where they say nothing.
        fit: kind of Magic Formula, "5.2", "6.1" or "6.2".
        side: on which the tyre was measured: "left", "right" or "symmetric".
        unused: names of numbers that no formula reads.
    """

    coefficients: dict[str, float]
    fit: str
    side: str
    unused: tuple[str, ...]


class _Entry(NamedTuple):
    line: int
    section: str
    text: str


def read_tir(path: str | os.PathLike) -> TirFile:
    """Read a tyre property file: PAC2002, and MF-Tyre 5.2, 6.1, 6.2 by FITTYP.

    Raises: ModelFileError with every fault and its line.
    """
    faults: list[str] = []
    entries = _entries(_text(path), faults)
    factors = _factors(entries, faults)
    fit, side = _fit(entries, faults), _side(entries, faults)
    numbers, unused = _numbers(entries, factors, faults)
    missing = [name for name in NEEDED if name not in numbers]
    if missing and not faults:
        faults.append(f"it has no {', '.join(missing)}")
    if faults:
        raise ModelFileError(path, faults)
    if unused:
        warn(f"{Path(path).name}: no formula here reads {', '.join(unused)}")
    return TirFile(numbers, fit, side, tuple(unused))


def _text(path):
    try:
        if not Path(path).is_file():
            raise ModelFileError(path, ["it cannot be read: there is no such file"])
        size = Path(path).stat().st_size
        if size > _MOST_BYTES:
            raise ModelFileError(path, [f"it has more than {_MOST_BYTES // 1_000_000} megabytes"])
        return Path(path).read_text(encoding="utf-8", errors="replace")
    except (OSError, ValueError) as error:
        if isinstance(error, ModelFileError):
            raise
        raise ModelFileError(path, [f"it cannot be read: {error}"]) from error


def _entries(text, faults):
    """Entries by name.  Rows of tables, which have no `=`, are left alone behind a line `{...}`."""
    found: dict[str, _Entry] = {}
    section, in_table = "", False
    for k, raw in enumerate(text.splitlines(), start=1):
        line = re.split(r"[$!]", raw, maxsplit=1)[0].strip()
        if not line:
            continue
        if line.startswith("["):
            if not line.endswith("]"):
                faults.append(f"line {k}: the section has no end: {line[:40]!r}")
            section, in_table = line.strip("[] ").upper(), False
        elif line.startswith("{"):
            in_table = True
        elif "=" in line:
            in_table = False
            _add(found, line, _Entry(k, section, ""), faults)
        elif not in_table:
            faults.append(f"line {k}: it is neither a section nor NAME = value: {line[:40]!r}")
    return found


def _add(found, line, entry, faults):
    name, _, value = (part.strip() for part in line.partition("="))
    name = name.upper()
    name = ALIASES.get(name, name)
    if not _NAME.match(name):
        faults.append(f"line {entry.line}: {name[:40]!r} is no name")
    elif name in found and name in KNOWN:
        faults.append(f"line {entry.line}: {name} is given before, in line {found[name].line}")
    else:
        found[name] = entry._replace(text=value.strip("'\" "))


def _factors(entries, faults):
    """Factors to SI units."""
    found = dict.fromkeys(_UNITS, 1.0)
    for name, known in _UNITS.items():
        entry = entries.get(name)
        if entry is None or entry.section != "UNITS":
            continue
        if entry.text.upper() not in known:
            faults.append(f"line {entry.line}: " + no_such("unit", entry.text.upper(), known))
        else:
            found[name] = known[entry.text.upper()]
    if "PRESSURE" not in entries:
        found["PRESSURE"] = found["FORCE"] / found["LENGTH"] ** 2
    return found


def _fit(entries, faults):
    kind, form = entries.get("FITTYP"), entries.get("PROPERTY_FILE_FORMAT")
    if kind is None:
        if form is not None and form.text.upper() in _FORMATS:
            return _FORMATS[form.text.upper()]
        faults.append("it says neither FITTYP nor PROPERTY_FILE_FORMAT = 'PAC2002': which Magic Formula is it?")
        return "6.1"
    value = _number(kind.text)
    if value not in _FITS:
        known = ", ".join(map(str, _FITS))
        faults.append(f"line {kind.line}: FITTYP = {kind.text} is none of {known}")
        return "6.1"
    return _FITS[int(value)]


def _side(entries, faults):
    entry = entries.get("TYRESIDE") or entries.get("TYRE_SIDE")
    if entry is None:
        return "left"
    if entry.text.upper() not in _SIDES:
        faults.append(f"line {entry.line}: TYRESIDE = {entry.text!r} must be one of {', '.join(_SIDES)}")
    return _SIDES.get(entry.text.upper(), "left")


def _numbers(entries, factors, faults):
    """Known numbers in SI units, and the names of those that no formula reads."""
    found, unused = {}, []
    for name, entry in entries.items():
        is_known = name in KNOWN
        of_forces = any(word in entry.section for word in _OF_FORCES)
        if not is_known and not of_forces:
            continue
        value = _number(entry.text)
        if value is None or not math.isfinite(value):
            faults.append(f"line {entry.line}: {name} = {entry.text[:40]!r} is no finite number")
        elif is_known and (value != 0.0 or name not in SWITCHES):
            found[name] = value * _scale(name, factors)
        elif not is_known and value != 0.0:
            unused.append(name)
    return found, unused


def _scale(name, factors):
    if name in PRESSURES:
        return factors["PRESSURE"]
    if name in ANGLES:
        return factors["ANGLE"]
    length, force, time = DIMENSIONS.get(name, (0, 0, 0))
    return factors["LENGTH"] ** length * factors["FORCE"] ** force * factors["TIME"] ** time


def _number(text):
    try:
        return float(text.replace("D", "e").replace("d", "e")) if text.isascii() and "_" not in text else None
    except ValueError:
        return None
