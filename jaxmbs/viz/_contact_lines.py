"""Lines of contacts in space: their surfaces and points of contact."""

from typing import NamedTuple

import jax
import numpy as np

from ..contact import (
    CylinderOnPlane,
    JournalInBush,
    RollerOnCurve,
    SphereInCylinder,
    SphereOnPlane,
    SphereOnSphere,
    WheelOnRoad,
)
from ..dynamics._contact_load import contact_groups, contact_of
from ..runtime import jit
from ._cable_lines import circle

_BALLS = (SphereOnPlane, SphereOnSphere, SphereInCylinder, WheelOnRoad)
_PER_POINT, _ALONG = 6, 160  # points of a curve for each of its own, and of a road


class ContactLines(NamedTuple):
    """A contact at all instants of a trajectory.

    Attributes:
        name: of the contact.
        lines: of the surfaces, (T, k, 3) each [m]; balls: (centres (T, 3), radius) of its spheres.
        points: (T, k, 3) of contact [m], NaN apart.
    """

    name: str
    lines: list
    balls: list
    points: np.ndarray


def contact_lines(system, film) -> list[ContactLines]:
    """All contacts of a system along a trajectory."""
    return [
        _contact(name, pair, (film.R[:, a], film.x[:, a]), (film.R[:, b], film.x[:, b]), film.extent)
        for name, pair, a, b in contact_pairs(system)
    ]


def contact_pairs(system) -> list[tuple]:
    """Name, pair of surfaces, and two frames of every contact."""
    found = []
    for group in contact_groups(system):
        law = contact_of(group.law)
        for k, (name, a, b) in enumerate(zip(group.names, group.first, group.second, strict=True)):
            found.append((name, jax.tree.map(lambda x, k=k: x[k], law.pair), a, b))
    return found


@jit(compile="tape")
def _touches(pair, R, x):
    return jax.vmap(lambda R, x: pair.touch(R, x)[::2])(R, x)


def _contact(name, pair, first, second, extent):
    """The lines of one contact, from rotations (T, 3, 3) and positions (T, 3) of its frames."""
    (A, a), (B, b) = first, second
    inside = np.einsum("tji,tj->ti", A, b - a)  # the round part in the axes of the surface
    depth, points = (np.asarray(part) for part in _touches(pair, np.einsum("tji,tjk->tik", A, B), inside))
    points = np.where((depth > 0.0)[..., None], points, np.nan)
    radius = round_radius(pair)
    balls = [(b, radius)] if isinstance(pair, _BALLS) and radius > 0 else []
    balls += [(a, float(pair.other_radius))] if isinstance(pair, SphereOnSphere) else []
    lines = [_in_world(A, a, line) for line in _surface(pair, inside, reach_in_surface(pair, inside, extent))]
    if isinstance(pair, CylinderOnPlane | JournalInBush):
        lines.append(_in_world(B, b, _tube(radius, -pair.length / 2, pair.length / 2)))
    if isinstance(pair, RollerOnCurve):
        lines.append(circle(b, A[:, :, 2], radius))
    return ContactLines(name, lines, balls, _in_world(A, a, points))


def _in_world(R, x, points):
    """World points (T, k, 3) of points (k, 3) or (T, k, 3) in the axes of a frame."""
    return x[:, None] + np.einsum("tij,...kj->tki" if points.ndim == 2 else "tij,tkj->tki", R, points)


def round_radius(pair) -> float:
    """Radius of the round part [m], zero of a point."""
    return float(getattr(pair, "radius", 0.0))


def reach_in_surface(pair, inside, extent: float) -> tuple[np.ndarray, np.ndarray]:
    """Corners (3,) of the box in which the round part (T, 3) passes, in the axes of the surface, and a margin."""
    half = float(pair.length) / 2 if isinstance(pair, CylinderOnPlane) else 0.0
    margin = round_radius(pair) + half + 0.1 * extent
    return inside.min(axis=0) - margin, inside.max(axis=0) + margin


def curve_points(pair: RollerOnCurve) -> np.ndarray:
    """Points (k, 3) of the outline of a cam, the first again at the end."""
    n = len(pair.curve.points)
    place = np.asarray(jax.vmap(lambda s: pair.curve.at(s)[0])(np.linspace(0.0, n, _PER_POINT * n + 1)))
    return np.column_stack([place, np.zeros(len(place))])


def _surface(pair, inside, reach):
    """Lines (k, 3) or (T, k, 3) of the surface on the first frame, near where the round part (T, 3) passes."""
    (low, high), radius = reach, round_radius(pair)
    if isinstance(pair, SphereOnPlane | CylinderOnPlane):
        corners = [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1]), (low[0], low[1])]
        return [np.array([(*corner, 0.0) for corner in corners])]
    if isinstance(pair, SphereInCylinder):
        return [_tube(radius + float(pair.clearance), low[2], high[2])]
    if isinstance(pair, JournalInBush):
        return [_tube(radius + float(pair.clearance), -pair.length / 2, pair.length / 2)]
    if isinstance(pair, RollerOnCurve):
        return [curve_points(pair)]
    if isinstance(pair, WheelOnRoad):
        x = np.linspace(float(pair.road.x[0]), float(pair.road.x[-1]), _ALONG)
        heights = jax.vmap(jax.vmap(pair.road, (0, None)), (None, 0))(x, inside[:, 1])
        across = np.broadcast_to(inside[:, 1:2], heights.shape)
        return [np.stack([np.broadcast_to(x, heights.shape), across, np.asarray(heights)], axis=2)]
    return []


def _tube(radius, low, high):
    """A line (k, 3) around both ends of a tube about the axis z, and along it."""
    centres = np.array([[0.0, 0.0, float(low)], [0.0, 0.0, float(high)]])
    return np.concatenate(circle(centres, np.array([[0.0, 0.0, 1.0]] * 2), radius))
