"""Solids of torsion springs and dampers: one part on the joint's parent, one on its child."""

import numpy as np

from ...palette import BRASS, DARK, STEEL
from ._solids import Solid, rotation_to_axis, sweep_tube, unit_cylinder


def torsion_solids(kind: str, axis: np.ndarray, radius: float) -> list[tuple[Solid, str]]:
    """(solid, colour) on the parent and on the child, about an axis through the origin, in the first pose.

    A spring is a spiral, its outer end at a finger of the child; a damper a drum with a vane that turns on it.

    Args: kind: "spring" or "damper"; axis: (3,); radius: that of the bars [m], beside which it stands.
    """
    if kind == "spring":
        share = np.linspace(0.0, 1.0, 121)
        angle, far = 5.0 * np.pi * share, radius * (1.4 + 3.2 * share)
        spiral = np.stack([far * np.cos(angle), far * np.sin(angle), np.full(121, 2.2 * radius)], axis=1)
        finger = unit_cylinder().scaled((0.5 * radius, 0.5 * radius, 2.4 * radius))
        parts = (sweep_tube(spiral, 0.3 * radius), BRASS), (finger.placed((-far[-1], 0.0, radius)), DARK)
    else:
        drum = unit_cylinder().scaled((3.6 * radius, 3.6 * radius, 0.8 * radius))
        vane = Solid.box((4.0 * radius, 0.9 * radius, 0.5 * radius))
        parts = (
            (drum.placed((0.0, 0.0, 1.7 * radius)), STEEL),
            (vane.placed((-2.0 * radius, 0.0, 2.75 * radius)), DARK),
        )
    turn = rotation_to_axis(np.asarray(axis, float))
    return [(solid.placed(rotation=turn), color) for solid, color in parts]
