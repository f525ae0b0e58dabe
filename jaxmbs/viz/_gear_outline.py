"""Outlines of gears: straight flanks between tip and root, thin enough that gears in mesh do not overlap."""

import numpy as np

from ..drawings import Gear

_ADDENDUM, _DEDENDUM = 1.0, 1.25  # of tip and root over the module, ISO 53
_FLANK = np.tan(np.pi / 9)  # of the flanks of the basic rack, ISO 53
_THICKNESS = 0.96  # of a tooth over half of the pitch


def gear_outline(gear: Gear) -> np.ndarray:
    """Points (4 teeth, 2) of a toothed rim, anticlockwise; those of a ring gear stand inwards."""
    radius, teeth = float(gear.radius), int(gear.teeth)
    module, side = 2.0 * radius / teeth, -1.0 if gear.is_ring else 1.0
    tip = radius + side * _ADDENDUM * module
    root = max(radius - side * _DEDENDUM * module, 0.1 * radius)
    half = _THICKNESS * np.pi / 2 / teeth  # angle of half of a tooth at the pitch circle
    at_tip, at_root = (half - side * _FLANK * (r - radius) / radius for r in (tip, root))
    angles = np.array([-at_root, -at_tip, at_tip, at_root])
    middles = float(gear.first) + 2 * np.pi * np.arange(teeth)[:, None] / teeth
    angle, far = (middles + angles).ravel(), np.tile([root, tip, tip, root], teeth)
    return far[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
