"""Solids of bodies in a scene: hulls of joints and points, meshes, boxes of inertia."""

from typing import Any

import numpy as np

from ...palette import COLORS, PALE
from .._body_shapes import default_shapes, inertia_box
from .._drawable import distinct_points, frames_with_blocks
from ._solids import Solid, rounded_hull

_MANY_BODIES = 40  # more are drawn with fewer corners, to keep the file below a megabyte


def add_bodies(scene: Any) -> None:
    """Add the solids of all bodies that no thing shows."""
    # Sizes below are in bar radii: symbols of joints must stand out of the bars, and were chosen by eye.
    shown = frames_with_blocks(scene.top, None, scene.slides)
    spared = {b for s in scene.slides if s.is_telescope for b in map(scene.body_of, s.joint.frames)}
    blocks = {scene.body_of(s.joint.frames[1]) for s in scene.slides}
    beams = {scene.top.frame_body[f] for joint in scene.top.joints if joint.is_elastic for f in joint.frames}
    meshed = {name for name, value in scene.shapes.items() if value is None}
    few = 2 if len(shown) > _MANY_BODIES else 3
    for body, frames in shown.items():
        name = scene.top.body_names[body] if body >= 0 else "ground"
        own = scene.shapes.get(name, scene.shapes.get(name.partition(".")[0]) if name in meshed else None)
        color = COLORS[body % len(COLORS)] if body >= 0 else PALE
        for solid in own or ():
            scene.add_solid(name, body + 1, solid, solid.color or color)
        if own or body < 0 or body + 1 in spared or scene.is_elastic(name) or body in beams:  # a mesh, or spans
            continue
        points = distinct_points([scene.trajectory.position_in_body(scene.top, f) for f in frames], 0.6 * scene.r)
        com = np.asarray(scene.system.com[body], float)
        if len(points) > 1:
            joints, named, axes = _points(scene, body, frames)
            for solid in default_shapes(joints, named, axes, scene.r, few):
                scene.add_solid(name, body + 1, solid, color)
        elif len(points) and np.linalg.norm(com - points[0]) > scene.r and body + 1 not in blocks:
            scene.add_solid(name, body + 1, rounded_hull([points[0], com], 0.6 * scene.r, few), color)
            _add_mass_marker(scene, name, body, com, color)
        elif body + 1 not in blocks:
            _add_mass_marker(scene, name, body, com, color)


def _points(scene, body, frames):
    """Positions of a body's joints and named frames, and axes of its revolute joints, in body axes."""
    joints, axes = [], []
    for joint in scene.top.joints:
        here = [f for f in joint.frames if f in frames]
        joints += [scene.trajectory.position_in_body(scene.top, f) for f in here]
        if here and joint.symbol == "pin" and joint.name in scene.trajectory.axes:
            world = scene.trajectory.R[0, joint.frames[0]] @ scene.trajectory.axes[joint.name]
            axes.append(scene.trajectory.R[0, body + 1].T @ world)
    others = set(frames) - {f for joint in scene.top.joints for f in joint.frames}
    named = [scene.trajectory.position_in_body(scene.top, f) for f in sorted(others)]
    return (np.array(part).reshape(-1, 3) for part in (joints, named, axes))


def _add_mass_marker(scene, name, body, com, color):
    """Add the inertia box of a body, or a ball where that is small or a thing shows the body's shape."""
    edges, axes = inertia_box(scene.system, body, scene.trajectory.extent)
    if edges.max(initial=0.0) < 2.0 * scene.r or body in scene.shaped:
        scene.add_unit_solid(name, body + 1, scene.solids.ball, com, (0, 0, 1), 2.2 * scene.r, 2.2 * scene.r, color)
    else:
        size = np.maximum(edges, 0.5 * scene.r)
        scene.add_solid(name, body + 1, Solid.box(size).placed(com, axes), color)
