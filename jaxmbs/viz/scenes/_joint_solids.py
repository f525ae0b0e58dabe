"""Solids of joints in a scene: pins, balls, plates, threads of screws, rails with blocks, cylinders, feet."""

from typing import Any

import numpy as np

from ...palette import COLORS, DARK, PALE, STEEL
from .._joint_strokes import STANDING
from ._solids import Solid, rotation_to_axis, unit_cone
from ._torsion_solids import thread_solid

RAIL = 5.0  # of a rail beyond the middle of its block, in bar radii


def add_joints(scene: Any) -> None:
    """Add the symbols of all joints, and the places of their names."""
    r = scene.r
    for slide in scene.slides:
        _add_slide(scene, slide)
    sliding = {s.joint.name: s for s in scene.slides}
    for joint in scene.top.joints:
        frame = joint.frames[0]
        body, place = scene.body_of(frame), scene.trajectory.position_in_body(scene.top, frame)
        if joint.symbol not in ("none", "free"):
            block = None if joint.name not in sliding else block_of(scene, sliding[joint.name])
            tag_body, point = (body, place) if block is None else block
            scene.tags.append({"name": joint.name, "body": tag_body, "point": point.tolist()})
        if joint.name in sliding or joint.name not in scene.trajectory.axes or scene.is_elastic(joint.name):
            continue
        axis = scene.axis_in_body(frame, scene.trajectory.axes[joint.name])
        if joint.symbol in ("pin", "screw", "cross"):
            axes = [axis] if joint.symbol != "cross" else [axis, np.cross(axis, [0.31, 0.87, 0.38])]
            for z in axes:
                z = z / np.linalg.norm(z)
                scene.add_unit_solid(
                    joint.name, body, scene.solids.cylinder, place - 1.5 * r * z, z, 0.6 * r, 3 * r, DARK
                )
            if joint.symbol == "screw":
                thread = thread_solid(r).placed(place, rotation_to_axis(axis))
                scene.add_solid(joint.name, body, thread, STEEL)
        elif joint.symbol == "ball":
            scene.add_unit_solid(joint.name, body, scene.solids.ball, place, axis, 1.4 * r, 1.4 * r, DARK)
        elif joint.symbol == "plane":  # goes with the child
            body, place = (
                scene.body_of(joint.frames[1]),
                scene.trajectory.position_in_body(scene.top, joint.frames[1]),
            )
            axis = scene.axis_in_body(joint.frames[1], scene.trajectory.axes[joint.name])
            scene.add_unit_solid(
                joint.name, body, scene.solids.cylinder, place - 0.2 * r * axis, axis, 4 * r, 0.2 * r, PALE
            )
        if body == 0 and joint.symbol in STANDING and not joint.is_hidden:
            _add_ground_support(scene, joint.name, place)


def block_of(scene: Any, slide: Any) -> tuple | None:
    """Body and place of the block of a slide; None of a telescope."""
    if slide.is_telescope:
        return None
    frame = slide.joint.frames[1]
    along = slide.offset * scene.axis_in_body(frame, slide.axis)  # both frames agree
    return scene.body_of(frame), scene.trajectory.position_in_body(scene.top, frame) + along


def _add_ground_support(scene, name, place):
    base = place - 4.5 * scene.r * scene.up
    scene.add_unit_solid(name, 0, scene.solids(unit_cone(0.35)), base, scene.up, 2.6 * scene.r, 4.5 * scene.r, PALE)


def _add_slide(scene, slide):
    """Add barrel and rod of a cylinder, else a rail with a block."""
    r, (a, b), name = scene.r, slide.joint.frames, slide.joint.name
    z = scene.axis_in_body(a, slide.axis), scene.axis_in_body(b, slide.axis)
    at = [scene.trajectory.position_in_body(scene.top, frame) for frame in (a, b)]
    low, high = slide.reach
    if slide.is_telescope:
        sign = 1.0 if low > 0 else -1.0
        least, most = min(abs(low), abs(high)), max(abs(low), abs(high))
        barrel = 0.9 * least
        rod = max(0.96 * least, most - 0.85 * barrel)
        scene.add_unit_solid(
            name, scene.body_of(a), scene.solids.cylinder, at[0], sign * z[0], 1.15 * r, barrel, STEEL
        )
        scene.add_unit_solid(name, scene.body_of(b), scene.solids.cylinder, at[1], -sign * z[1], 0.6 * r, rod, PALE)
        return
    start, length = at[0] + (low - RAIL * r) * z[0], high - low + 2 * RAIL * r
    scene.add_unit_solid(name, scene.body_of(a), scene.solids.cylinder, start, z[0], 0.45 * r, length, STEEL)
    color, middle = COLORS[(scene.body_of(b) - 1) % len(COLORS)], at[1] + slide.offset * z[1]
    if slide.joint.symbol == "sleeve":
        scene.add_unit_solid(
            name, scene.body_of(b), scene.solids.cylinder, middle - 2 * r * z[1], z[1], 1.2 * r, 4 * r, color
        )
    else:
        block = Solid.box((2.8 * r, 2.8 * r, 5.2 * r)).placed(middle, rotation_to_axis(z[1]))
        scene.add_solid(name, scene.body_of(b), block, color)
