"""Solids about the axis of a joint: torsion springs, dampers and drives, a part on parent and child; a thread."""

import numpy as np

from ...palette import BRASS, COLORS, DARK, STEEL
from ._solids import Solid, rotation_to_axis, sweep_tube, unit_cylinder


def torsion_solids(kind: str, axis: np.ndarray, radius: float) -> list[tuple[Solid, str]]:
    """(solid, colour) on the parent and on the child, about an axis through the origin, in the first pose.

    A spring is a spiral, its outer end at a finger of the child; a damper a drum with a vane that turns on it; a
    drive a housing with a disk that turns before it.

    Args: kind: "spring", "damper" or "actuator"; axis: (3,); radius: that of the bars [m], beside which it stands.
    """
    if kind == "spring":
        share = np.linspace(0.0, 1.0, 121)
        angle, far = 5.0 * np.pi * share, radius * (1.4 + 3.2 * share)
        spiral = np.stack([far * np.cos(angle), far * np.sin(angle), np.full(121, 2.2 * radius)], axis=1)
        finger = unit_cylinder().scaled((0.5 * radius, 0.5 * radius, 2.4 * radius))
        parts = (sweep_tube(spiral, 0.3 * radius), BRASS), (finger.placed((-far[-1], 0.0, radius)), DARK)
    elif kind == "actuator":
        housing = unit_cylinder().scaled((3.0 * radius, 3.0 * radius, 3.6 * radius))
        disk = Solid.box((4.4 * radius, 1.2 * radius, 0.6 * radius))
        parts = (housing.placed((0.0, 0.0, -5.2 * radius)), COLORS[1]), (disk.placed((0.0, 0.0, -1.3 * radius)), DARK)
    else:
        drum = unit_cylinder().scaled((3.6 * radius, 3.6 * radius, 0.8 * radius))
        vane = Solid.box((4.0 * radius, 0.9 * radius, 0.5 * radius))
        parts = (
            (drum.placed((0.0, 0.0, 1.7 * radius)), STEEL),
            (vane.placed((-2.0 * radius, 0.0, 2.75 * radius)), DARK),
        )
    turn = rotation_to_axis(np.asarray(axis, float))
    return [(solid.placed(rotation=turn), color) for solid, color in parts]


def thread_solid(radius: float) -> Solid:
    """A thread about the axis z, for the joint of a screw."""
    share = np.linspace(-1.0, 1.0, 129)
    angle, far = 10.0 * np.pi * share, 0.95 * radius
    return sweep_tube(
        np.stack([far * np.cos(angle), far * np.sin(angle), 5.0 * radius * share], axis=1), 0.3 * radius
    )
