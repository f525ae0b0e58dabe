"""Default shapes of bodies: bars between joints, plates for planar links, branches to named frames."""

import numpy as np
from jaxtyping import Float

from ..typing import ScalarLike
from ._drawable import distinct_points
from .scenes._solids import Solid, rounded_hull

_COINCIDENT = 0.6  # of the radius: balls about points nearer than this would be hidden in one another
_BRANCH_RADIUS = 0.5  # of the radius: branches are visibly thinner than bars


def default_shapes(
    joints: Float[np.ndarray, "j 3"],
    frames: Float[np.ndarray, "f 3"],
    axes: Float[np.ndarray, "a 3"],
    radius: ScalarLike,
    divisions: int,
) -> list[Solid]:
    """Solids of a body, none if it has fewer than two points.

    A link in a plane, which turns about its normal, is a plate through all of its points.  Any other body is the hull
    of its joints, a bar for two, with thin branches to the named frames: the hull of all points would make a slab of
    a robot's link that carries a tool or a sensor.

    Args:
        joints, frames: where its joints and its named frames are; axes: of its joints that turn; in body axes.
    """
    points = distinct_points([*joints, *frames], _COINCIDENT * radius)
    if len(points) < 2:
        return []
    if len(points) == 2 or _is_plate(points, axes):
        return [rounded_hull(points, radius, divisions)]
    core = distinct_points(joints, _COINCIDENT * radius)
    if len(core) < 2:  # its bar leads to the furthest point
        first = points[:1]
        core = np.concatenate([first, points[[np.argmax(np.linalg.norm(points - first, axis=1))]]])
    away = [point for point in points if np.linalg.norm(point - _nearest_point(core, point)) > radius]
    branches = [
        rounded_hull([_nearest_point(core, point), point], _BRANCH_RADIUS * radius, divisions) for point in away
    ]
    return [rounded_hull(core, radius, divisions), *branches]


def inertia_box(system, body: int, extent: float) -> tuple[np.ndarray, np.ndarray]:
    """Edges (3,) of the homogeneous box with the inertia of a body, and its axes (3, 3), columns in body axes.

    The edges are zero where no box has it, or where the box is too large to be believed: a link with an invented
    inertia would be a slab as large as the robot.
    """
    mass, inertia = float(system.mass[body]), np.asarray(system.inertia[body], float)
    values, axes = np.linalg.eigh((inertia + inertia.T) / 2)
    squares = 6.0 * (values.sum() - 2.0 * values) / mass if mass > 0 else 0.0 * values
    edges = np.sqrt(np.maximum(squares, 0.0))
    most = (1.5 if system.topology.bodies.size == 1 else 0.35) * extent
    return edges * (edges.max(initial=0.0) <= most), axes * np.sign(np.linalg.det(axes))


def _is_plate(points, axes):
    """True if points lie on a line, or in a plane normal to one of the axes."""
    _, spread, across = np.linalg.svd(points - points.mean(axis=0))
    if spread[1] < 1e-3 * spread[0]:
        return True
    return spread[2] < 1e-3 * spread[0] and any(abs(axis @ across[2]) > 0.99 * np.linalg.norm(axis) for axis in axes)


def _nearest_point(core, point):
    """The nearest point of a bar, or the nearest corner of a hull."""
    if len(core) > 2:
        return core[np.argmin(np.linalg.norm(core - point, axis=1))]
    a, b = core
    share = (point - a) @ (b - a) / ((b - a) @ (b - a))
    return a + np.clip(share, 0.0, 1.0) * (b - a)
