"""Coefficients of the Magic Formula: names, defaults, and other names of the same."""

from collections.abc import Mapping
from typing import Any

#: Values of coefficients that a file leaves out, where they are not zero; scale factors are one.
DEFAULTS = {"PKY4": 2.0, "Q_RE0": 1.0, "QSY7": 1.0, "LMUV": 0.0, "VXLOW": 1.0, "LONGVL": 16.7, "ASPECT_RATIO": 0.7}
#: Names of other programs.
ALIASES = {
    **{f"PPFX{k}": f"PPX{k}" for k in range(1, 5)},
    **{f"PPFY{k}": f"PPY{k}" for k in range(1, 6)},
    **{"QPFZ1": "PFZ1", "PPFZ1": "PFZ1", "QPZ1": "PPZ1", "QPZ2": "PPZ2", "QPX1": "PPMX1", "QFZ1": "Q_FZ1"},
    **{"QFZ2": "Q_FZ2", "QFZ3": "Q_FZ3", "QFCX1": "Q_FCX", "QFCY1": "Q_FCY", "QFCY2": "Q_FCY2", "QV1": "Q_V1"},
    **{"QV2": "Q_V2", "QRE0": "Q_RE0", "LFZ0": "LFZO", "LKYG": "LKYC", "LKG": "LKYC"},
}


def _numbered(text: str) -> set[str]:
    """Names of "PKX1-3 PHX1-2"."""
    found = set()
    for word in text.split():
        stem, _, last = word.partition("-")
        first = int(stem[-1]) if last else 0
        found |= {stem[:-1] + str(k) for k in range(first, int(last) + 1)} if last else {word}
    return found


#: Scale factors.
SCALES = _numbered(
    "LFZO LCX LMUX LEX LKX LHX LVX LCY LMUY LEY LKY LHY LVY LGAX LGAY LGAZ LTR LRES LXAL LYKA LVYKA LS LKYC LKZC LVMX"
    " LMX LMY LSGKP LSGAL LCZ LMUV"
)
#: What the formulas read, without scale factors and dimensions.
SHAPES = _numbered(
    "PCX1 PDX1-3 PEX1-4 PKX1-3 PHX1-2 PVX1-2 PPX1-4 RBX1-3 RCX1 REX1-2 RHX1 PTX1-3 PCY1 PDY1-3 PEY1-5 PKY1-7 PHY1-3"
    " PVY1-4 PPY1-5 RBY1-4 RCY1 REY1-2 RHY1-2 RVY1-6 PTY1-2 QBZ1-6 QBZ9 QBZ10 QCZ1 QDZ1-4 QDZ6-9 QDZ10 QDZ11 QEZ1-5"
    " QHZ1-4 SSZ1-4 PPZ1-2 QSX1-9 QSX10 QSX11 QSX12 QSX13 QSX14 PPMX1 QSY1-8 Q_FZ1-3 Q_V1-2 Q_RE0 Q_FCX Q_FCY Q_FCY2"
    " Q_CAM1-3 Q_FYS1-3 PFZ1 BREFF DREFF FREFF PCFX1-3 PCFY1-3 ASPECT_RATIO"
)
#: Numbers with dimensions, as powers of length, force and time; pressures are apart.
DIMENSIONS = {
    "FNOMIN": (0, 1, 0),
    "UNLOADED_RADIUS": (1, 0, 0),
    "WIDTH": (1, 0, 0),
    "RIM_RADIUS": (1, 0, 0),
    "RIM_WIDTH": (1, 0, 0),
    "LONGVL": (1, 0, -1),
    "VXLOW": (1, 0, -1),
    "VERTICAL_STIFFNESS": (-1, 1, 0),
    "VERTICAL_DAMPING": (-1, 1, 1),
    "LONGITUDINAL_STIFFNESS": (-1, 1, 0),
    "LATERAL_STIFFNESS": (-1, 1, 0),
    "BOTTOM_OFFST": (1, 0, 0),
    "BOTTOM_STIFF": (-1, 1, 0),
    **{name: (0, 1, 0) for name in ("FZMIN", "FZMAX")},
    **{name: (0, 0, 0) for name in ("KPUMIN", "KPUMAX", "ALPMIN", "ALPMAX", "CAMMIN", "CAMMAX")},
}
ANGLES = ("ALPMIN", "ALPMAX", "CAMMIN", "CAMMAX")
PRESSURES = ("INFLPRES", "NOMPRES", "PRESMIN", "PRESMAX")
#: Every number that is kept.
KNOWN = SCALES | SHAPES | set(DIMENSIONS) | set(PRESSURES)
#: Coefficients that are left out where they are zero, as they bring equations of their own.
SWITCHES = _numbered(
    "LMUV Q_FZ1-2 Q_V1-2 Q_FCX Q_FCY Q_FCY2 Q_CAM1-3 Q_FYS1-3 BREFF DREFF FREFF BOTTOM_STIFF VERTICAL_STIFFNESS"
    " LONGITUDINAL_STIFFNESS LATERAL_STIFFNESS PKY4 Q_RE0 LONGVL VXLOW NOMPRES INFLPRES"
)
#: What a tyre cannot do without.
NEEDED = ("FNOMIN", "UNLOADED_RADIUS", "PCX1", "PDX1", "PKX1", "PCY1", "PDY1", "PKY1", "PKY2")


class Coefficients:
    """Coefficients by attribute: `p.PKY1`, with defaults for those that are left out."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        self._values = values

    def __getattr__(self, name: str) -> Any:
        default = DEFAULTS.get(name, 1.0 if name in SCALES else 0.0)
        return self._values.get(name, default)

    def __contains__(self, name: str) -> bool:
        return name in self._values
