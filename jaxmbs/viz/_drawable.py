"""Drawable parts of a mechanism: points of bodies, sliding joints, elements between two points, torsion springs."""

from typing import NamedTuple

import jax
import numpy as np

from ..dynamics._contact_load import contact_groups
from ..forces._cable_route import CableRoute
from ..forces._ports import JointPort, LinePort, PosePort
from ..joints import Distance

SLIDES = ("Prismatic", "Cylindrical")


class Span(NamedTuple):
    """An element between two frames: "spring", "damper", "actuator", "bushing", "rod" or "cable"."""

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


def spans(system) -> list[Span]:
    """All laws but contacts between two frames or on a slide, rods of constant length, elastic bodies between
    interfaces, and cables from each element to the next."""
    top, found = system.topology, []
    sliding = {j.first_velocity: j.frames for j in top.joints if j.kind in SLIDES and j.num_velocities}
    touching = [id(group) for group in contact_groups(system)]
    for group in system.forces:
        if id(group) in touching:
            continue
        for k, (name, a, b) in enumerate(zip(group.names, group.first, group.second, strict=True)):
            kind = _law_kind(group, jax.tree.map(lambda x, k=k: x[k], group.law))
            if isinstance(group.port, LinePort | PosePort):
                found.append(Span(name, kind, (a, b)))
            elif isinstance(group.port, JointPort) and kind in ("spring", "damper") and a in sliding:
                found.append(Span(name, kind, sliding[a]))
    for group in system.closures:
        if isinstance(group.kind, Distance):
            ends = zip(group.names, group.first, group.second, strict=True)
            found += [Span(name, "rod", (a, b)) for name, a, b in ends]
    for group in system.elastic:
        for name, frames in zip(group.names, group.frames, strict=True):
            found += [Span(name, "rod", (frames[0], other)) for other in frames[1:]]
    for name, law, frames in cables(system):
        following = (*frames[1:], frames[0]) if law.closed else frames[1:]
        found += [Span(name, "cable", pair) for pair in zip(frames, following, strict=False)]
    return found


def cables(system) -> list[tuple]:
    """All cables: name, law, and frames of the elements."""
    found = []
    for group in (*system.rows, *system.forces):
        if isinstance(group.law, CableRoute):
            each = zip(group.names, group.frames, strict=True)
            found += [(name, jax.tree.map(lambda x, k=k: x[k], group.law), f) for k, (name, f) in enumerate(each)]
    return found


class Torsion(NamedTuple):
    """A "spring" or "damper" that acts about the axis of a joint."""

    name: str
    kind: str
    joint: object


def torsions(system) -> list[Torsion]:
    """All springs and dampers on revolute joints, S2 Figs 5 and 6."""
    turning = {j.first_velocity: j for j in system.topology.joints if j.kind == "Revolute" and j.num_velocities}
    found = []
    for group in system.forces:
        for k, (name, a) in enumerate(zip(group.names, group.first, strict=True)):
            if isinstance(group.port, JointPort) and a in turning:
                kind = _law_kind(group, jax.tree.map(lambda x, k=k: x[k], group.law))
                found += [Torsion(name, kind, turning[a])] if kind in ("spring", "damper") else []
    return found


def _law_kind(group, law):
    """Symbol of a law: a spring if it stores energy, a damper if it only dissipates."""
    if isinstance(group.port, PosePort):
        return "bushing"
    if law.stores:
        return "spring"
    return "damper" if hasattr(law, "damping") else "actuator"


def body_frames(topology, names=None) -> dict[int, list[int]]:
    """Frames drawn on each body (-1 ground): its ends of joints, then the named ones (default: all)."""
    shown: dict[int, list[int]] = {body: [] for body in (-1, *range(topology.bodies.size))}
    for joint in topology.joints:
        if joint.kind == "Modal":  # moves no frame
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
        if joint.kind not in SLIDES or joint.name not in film.axes:
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
