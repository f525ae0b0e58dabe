"""Units of FMI from the text of a unit: exponents of SI base units and a factor."""

import re
from xml.etree import ElementTree

#: Exponents of (kg, m, s, A, K, mol, cd, rad) and the factor of units with a name.
_KNOWN: dict[str, tuple[dict[str, int], float]] = {
    "1": ({}, 1.0),
    "kg": ({"kg": 1}, 1.0),
    "g": ({"kg": 1}, 1e-3),
    "t": ({"kg": 1}, 1e3),
    "m": ({"m": 1}, 1.0),
    "mm": ({"m": 1}, 1e-3),
    "s": ({"s": 1}, 1.0),
    "ms": ({"s": 1}, 1e-3),
    "A": ({"A": 1}, 1.0),
    "K": ({"K": 1}, 1.0),
    "rad": ({"rad": 1}, 1.0),
    "deg": ({"rad": 1}, 0.017453292519943295),
    "N": ({"kg": 1, "m": 1, "s": -2}, 1.0),
    "kN": ({"kg": 1, "m": 1, "s": -2}, 1e3),
    "J": ({"kg": 1, "m": 2, "s": -2}, 1.0),
    "W": ({"kg": 1, "m": 2, "s": -3}, 1.0),
    "Pa": ({"kg": 1, "m": -1, "s": -2}, 1.0),
    "MPa": ({"kg": 1, "m": -1, "s": -2}, 1e6),
    "V": ({"kg": 1, "m": 2, "s": -3, "A": -1}, 1.0),
    "Ohm": ({"kg": 1, "m": 2, "s": -3, "A": -2}, 1.0),
    "H": ({"kg": 1, "m": 2, "s": -2, "A": -2}, 1.0),
    "Hz": ({"s": -1}, 1.0),
}


def base_units(unit: str) -> tuple[dict[str, int], float] | None:
    """Exponents of base units and the factor of "N m/rad", "kg m^2", "(m/s^2)^2/Hz"; None for what is not known.

    Powers are "m^2", "m**2" or "m2", products "N m", "N*m" or "N.m".
    """
    unit, brackets = unit.replace("**", "^").replace("\u00b2", "^2").replace("\u00b3", "^3"), _KNOWN
    while inner := re.search(r"\(([^()]*)\)", unit):  # its place takes a name of its own
        found, name = _product(inner[1], brackets), "_" * len(unit)
        if found is None:
            return None
        brackets, unit = brackets | {name: found}, f"{unit[: inner.start()]} {name}{unit[inner.end() :]}"
    return _product(unit, brackets)


def _product(unit, known):
    """As `base_units`, without brackets."""
    exponents: dict[str, int] = {}
    factor, sign = 1.0, 1
    for part in re.findall(r"/|[^\s/*.\u00b7]+", unit):
        if part == "/":
            sign = -1
            continue
        found = re.fullmatch(r"([A-Za-z]+|_+|1)\^?(-?\d{1,2})?", part)
        if not found or found[1] not in known:
            return None
        power = sign * int(found[2] or 1)
        own, scale = known[found[1]]
        factor *= scale**power
        for name, exponent in own.items():
            exponents[name] = exponents.get(name, 0) + power * exponent
        sign = 1 if sign > 0 else sign  # all after a stroke is below it
    return {name: x for name, x in exponents.items() if x}, factor


def unit_definitions(units: list[str]) -> ElementTree.Element:
    """The element of all units; those that are not known have a name alone."""
    root = ElementTree.Element("UnitDefinitions")
    for unit in sorted(set(units)):
        element, base = ElementTree.SubElement(root, "Unit", name=unit), base_units(unit)
        if base is not None:
            exponents, factor = base
            values = {name: str(x) for name, x in exponents.items()}
            if factor != 1.0:
                values["factor"] = repr(factor)
            ElementTree.SubElement(element, "BaseUnit", values)
    return root
