"""A tyre, 235/60 R16, by the public sample of coefficients of PAC2002, and files of it."""

import json
from pathlib import Path

from jaxmbs import vehicles

CASE = json.loads((Path(__file__).parent.parent / "cases" / "TY1_pac2002_tyre.json").read_text())
COEFFICIENTS = {name: value for name, value in CASE["parameters"].items() if not isinstance(value, str)}
COEFFICIENTS["UNLOADED_RADIUS"] = COEFFICIENTS.pop("R0")
VERTICAL = {"VERTICAL_STIFFNESS": 2e5, "VERTICAL_DAMPING": 50.0, "BREFF": 8.0, "DREFF": 0.24, "FREFF": 0.01}
WHOLE = COEFFICIENTS | VERTICAL | {"QSY1": 0.01}


def sample(coefficients=None, **options):
    """The tyre as a law."""
    return vehicles.Tyre(vehicles.MagicFormula(WHOLE | (coefficients or {}), "5.2"), **options)


def tir_text(coefficients=None, head="", units="LENGTH = 'meter'\nFORCE = 'newton'", model="FITTYP = 6"):
    """A property file."""
    own = WHOLE if coefficients is None else coefficients
    rows = "\n".join(f"{name:24} = {value!r}  $ a comment" for name, value in own.items())
    return f"{head}[UNITS]\n{units}\n$---- model\n[MODEL]\n{model}\n[COEFFICIENTS]\n{rows}\n"
