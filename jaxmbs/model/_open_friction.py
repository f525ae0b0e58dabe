"""Rubbing joints whose load rigid statics leaves open, from the redundant constraints that the build counted."""

import numpy as np

from ..checks import is_concrete
from ..errors import warn
from ..friction._surfaces import SURFACES, surface_rows
from ._describe import COMPONENTS

_TILT = 1e-6  # of axes, below which one does not see the components along the other


def open_friction(system) -> dict[str, tuple[str, ...]]:
    """Components (axes of the joint) that load a rubbing surface and that statics does not determine, by joint."""
    f, top = system.friction, system.topology
    if f is None or top.analysis is None or not top.analysis.redundant:
        return {}
    found: dict[str, tuple[str, ...]] = {}
    for k, (joint, kind) in enumerate(zip(f.joints, f.kinds, strict=True)):
        marks = np.asarray(top.analysis.undetermined[joint], bool)
        seen = marks & _loading(kind, f.basis[k])
        if seen.any():
            found[top.joints[joint].name] = tuple(np.array(COMPONENTS)[seen].tolist())
    return found


def _loading(kind, basis):
    """True (6,) for the components, in the order of `COMPONENTS`, that load a surface of this geometry."""
    rows = surface_rows((kind,), float)
    local = np.any((rows.load != 0.0) | (rows.load_by_length != 0.0), axis=0)
    turn = np.abs(np.asarray(basis)) > _TILT if is_concrete(basis) else np.ones((3, 3), bool)
    if SURFACES[kind].is_thread:  # its axial force does work, and loads the thread
        local = local | np.array([False, False, True, False, False, False])
    return np.concatenate([turn @ local[3:], turn @ local[:3]])


def open_friction_lines(system) -> list[str]:
    """One sentence for each such joint."""
    return [
        f"friction of joint {name!r}: redundant constraints leave its load open ({', '.join(parts)}); "
        "it is shared by least compliance"
        for name, parts in open_friction(system).items()
    ]


def warn_of_open_friction(system) -> None:
    """Warn of joints whose friction follows a load that statics does not determine."""
    if not (lines := open_friction_lines(system)):
        return
    others = ", ".join(system.topology.analysis.redundant_names)
    warn(
        "; ".join(lines) + ", with equal compliances, as that of `reactions`: friction and loads of these joints are "
        f"one answer of many; free these directions in one of {others} (two hinges in line: one Spherical, "
        "and a PointOnLine constraint for the other), or let bushings carry them"
    )
