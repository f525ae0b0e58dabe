"""Drawable parts of a mechanism: points of bodies, sliding joints, elements between two points, torsion springs."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from ..model._topology import JointRecord
from ._things import Thing

SLIDES = ("slide", "sleeve")  # symbols of joints
_CYLINDERS = ("actuator", "cylinder")  # symbols of what drives a joint
_TORSIONS = {"spring": "spring", "damper": "damper", "maxwell": "damper"} | dict.fromkeys(_CYLINDERS, "actuator")


class Slide(NamedTuple):
    """A sliding joint.

    The block of the child lies `offset` [m] along the axis from its frame, at another joint of it if one lies on the
    axis: a piston declared by a guide at its crank's bearing is drawn at its pin.  `reach` are the least and largest
    distance of the block from the parent's frame along the axis [m]; `is_telescope` is True if both bodies lie along
    it, as barrel and rod of a cylinder.
    """

    joint: JointRecord
    axis: np.ndarray
    reach: tuple[float, float]
    offset: float
    is_telescope: bool


class Span(NamedTuple):
    """An element between two frames, or from the rail of a slide to its block.

    `kind` is a symbol of `drawings.SYMBOLS`, `lane` its place among those side by side, zero in the middle.
    """

    name: str
    kind: str
    frames: tuple[int, int]
    lane: float = 0.0
    slide: Slide | None = None


def spans(things: Iterable[Thing], slides: Iterable[Slide]) -> list[Span]:
    """Symbols between two frames, and those on slides; a telescope looks like a cylinder or a damper itself."""
    by_name, found = {slide.joint.name: slide for slide in slides}, []
    for thing in things:
        slide = None if thing.joint is None else by_name.get(thing.joint.name)
        if thing.joint is not None and slide is None:
            continue
        own = ("damper", *_CYLINDERS) if slide is not None and slide.is_telescope else ()
        shown = [symbol for symbol in thing.symbols if symbol.kind not in own]
        pairs = [s.frames for s in shown]
        for k, (symbol, (a, b)) in enumerate(zip(shown, pairs, strict=True)):
            lane = pairs[:k].count((a, b)) - (pairs.count((a, b)) - 1) / 2
            frames = (thing.frames[a], thing.frames[b])
            found.append(Span(thing.name, symbol.kind, frames, lane, slide))
    return found


class Torsion(NamedTuple):
    """A "spring", a "damper" or an "actuator" that acts about the axis of a joint."""

    name: str
    kind: str
    joint: JointRecord


def torsions(things: Iterable[Thing]) -> list[Torsion]:
    """All springs, dampers and drives on revolute joints, S2 Figs 5 and 6."""
    return [
        Torsion(thing.name, _TORSIONS[symbol.kind], thing.joint)
        for thing in things
        if thing.joint is not None and thing.joint.symbol == "pin"
        for symbol in thing.symbols
        if symbol.kind in _TORSIONS
    ]


def body_frames(topology, names=None) -> dict[int, list[int]]:
    """Frames drawn on each body (-1 ground): its ends of joints, then the named ones (default: all)."""
    shown: dict[int, list[int]] = {body: [] for body in (-1, *range(topology.bodies.size))}
    for joint in topology.joints:
        if joint.symbol == "none":  # moves no frame
            continue
        for body, frame in zip((joint.parent, joint.child), joint.frames, strict=True):
            shown[body].append(frame)
    ends = {frame for joint in topology.joints for frame in joint.frames}
    for frame, (name, body) in enumerate(zip(topology.frame_names, topology.frame_body, strict=True)):
        named = name and frame > topology.bodies.size and frame not in ends
        if named and (names is None or name in names):
            shown[body].append(frame)
    return shown


def slides(system, film) -> list[Slide]:
    """The sliding joints of a mechanism along a trajectory."""
    top, found = system.topology, []
    points = {body: _points_in_body(film, top, frames) for body, frames in body_frames(top).items()}
    for joint in top.joints:
        if joint.symbol not in SLIDES or joint.name not in film.axes:
            continue
        a, b = joint.frames
        axis = film.axes[joint.name]
        along = np.einsum("tij,j->ti", film.R[:, a], axis)
        distance = np.einsum("ti,ti->t", film.x[:, b] - film.x[:, a], along)
        ends = [(top.frame_body[frame], film.R[0, frame] @ axis) for frame in (a, b)]
        telescope = all(
            body >= 0 and _is_along(points[body], film.R[0, body + 1].T @ world, film.extent) for body, world in ends
        )
        reach = (float(distance.min()), float(distance.max()))
        far = max(np.abs(reach)) > 0.02 * film.extent
        telescope = telescope and far and reach[0] * reach[1] > 0
        offset = 0.0 if telescope else _block_offset(top, film, joint)
        found.append(Slide(joint, axis, (reach[0] + offset, reach[1] + offset), offset, telescope))
    return found


def _block_offset(topology, film, joint) -> float:
    """Distance along a slide's axis from the child's frame to the nearest other joint of the child on the axis."""
    if joint.child < 0:
        return 0.0
    own, others = joint.frames[1], [f for other in topology.joints for f in other.frames if other is not joint]
    there = [f for f in others if topology.frame_body[f] == joint.child]
    axis = film.R[0, joint.frames[0]] @ film.axes[joint.name]
    arms = np.array([film.x[0, f] - film.x[0, own] for f in there]).reshape(-1, 3)
    along = arms @ axis
    on_axis = along[np.linalg.norm(arms - along[:, None] * axis, axis=1) < 1e-3 * film.extent]
    return float(min(on_axis, key=abs, default=0.0))


def frames_with_blocks(topology, names, slides: Iterable[Slide]) -> dict[int, list[int]]:
    """`body_frames` without frames inside of elastic bodies, and those of slides whose block lies elsewhere."""
    left_out = {slide.joint.frames[1] for slide in slides if slide.offset}
    left_out |= {frame for joint in topology.joints if joint.is_elastic for frame in joint.frames}
    shown = body_frames(topology, names)
    return {body: [frame for frame in frames if frame not in left_out] for body, frames in shown.items()}


def _points_in_body(film, topology, frames):
    return np.array([film.position_in_body(topology, frame) for frame in frames]).reshape(-1, 3)


def _is_along(points, axis, extent):
    """True if points (n, 3) lie on one line along an axis."""
    offset = points - points[:1]
    return bool(np.all(np.linalg.norm(np.cross(offset, axis), axis=1) < 1e-3 * extent))


def distinct_points(points, near) -> np.ndarray:
    """Points (n, 3) without those nearer than `near` to an earlier one."""
    kept: list = []
    for point in np.asarray(points, float).reshape(-1, 3):
        if all(np.linalg.norm(point - other) > near for other in kept):
            kept.append(point)
    return np.array(kept).reshape(-1, 3)
