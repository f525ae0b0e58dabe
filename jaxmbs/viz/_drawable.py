"""Drawable parts of a mechanism: points of bodies, sliding joints, elements between two points, torsion springs."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from ._things import Thing

SLIDES = ("slide", "sleeve")  # symbols of joints


class Span(NamedTuple):
    """An element between two frames: a symbol of `drawings.SYMBOLS`."""

    name: str
    kind: str
    frames: tuple[int, int]


class Slide(NamedTuple):
    """A sliding joint.

    `reach` are the least and largest distance of its frames along the axis [m]; `is_telescope` is True if both bodies
    lie along it, as barrel and rod of a cylinder.
    """

    joint: object
    axis: np.ndarray
    reach: tuple[float, float]
    is_telescope: bool


def spans(things: Iterable[Thing]) -> list[Span]:
    """Symbols between two frames, and springs and dampers on slides."""
    found = []
    for thing in things:
        for symbol in thing.symbols:
            if thing.joint is None:
                a, b = symbol.frames
                found.append(Span(thing.name, symbol.kind, (thing.frames[a], thing.frames[b])))
            elif thing.joint.symbol in SLIDES and symbol.kind in ("spring", "damper"):
                found.append(Span(thing.name, symbol.kind, thing.joint.frames))
    return found


class Torsion(NamedTuple):
    """A "spring" or "damper" that acts about the axis of a joint."""

    name: str
    kind: str
    joint: object


def torsions(things: Iterable[Thing]) -> list[Torsion]:
    """All springs and dampers on revolute joints, S2 Figs 5 and 6."""
    return [
        Torsion(thing.name, symbol.kind, thing.joint)
        for thing in things
        if thing.joint is not None and thing.joint.symbol == "pin"
        for symbol in thing.symbols
        if symbol.kind in ("spring", "damper")
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
        found.append(Slide(joint, axis, reach, telescope and far and reach[0] * reach[1] > 0))
    return found


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
