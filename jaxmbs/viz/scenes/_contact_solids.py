"""Solids of contacts: planes, tubes, cams, roads, and the round parts on them."""

from typing import NamedTuple

import jax
import numpy as np
from scipy.spatial import Delaunay

from ...contact import (
    CylinderOnPlane,
    JournalInBush,
    RollerOnCurve,
    SphereInCylinder,
    SphereOnPlane,
    SphereOnSphere,
    WheelOnRoad,
)
from .._contact_lines import contact_pairs, curve_points, reach_in_surface, round_radius
from ._solids import Solid, join_solids

_AROUND, _ALONG, _ACROSS = 48, 96, 12  # points around a tube, along and across a road


class ContactSolid(NamedTuple):
    """A solid in the axes of a frame: of a surface the first frame of the contact, of a round part the second."""

    name: str
    frame: int
    solid: Solid
    is_surface: bool


def contact_solids(system, film, radius: float) -> list[ContactSolid]:
    """Solids of all contacts along a trajectory; surfaces without a thickness of their own get that of a bar."""
    found = []
    for name, pair, first, second in contact_pairs(system):
        inside = film.position_in_frame(first, second)
        solids = _surface(pair, inside, reach_in_surface(pair, inside, film.extent), radius)
        found += [ContactSolid(name, first, solid, True) for solid in solids]
        found += [ContactSolid(name, second, solid, False) for solid in _round_part(pair, radius)]
    return found


def contact_corners(found: list[ContactSolid], film) -> list[np.ndarray]:
    """Points (n, 3) in the world that the solids reach: corners of surfaces, ends of round parts."""
    cube, star, points = np.indices((2, 2, 2)).reshape(3, -1).T * 2 - 1, np.concatenate([np.eye(3), -np.eye(3)]), []
    for _, frame, solid, is_surface in found:
        low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
        places = (low + high) / 2 + (cube if is_surface else star) * (high - low) / 2
        points.append((np.einsum("tij,kj->tki", film.R[:, frame], places) + film.x[:, None, frame]).reshape(-1, 3))
    return points


def _surface(pair, inside, reach, thick):
    """Solids of the surface on the first frame, where the round part (T, 3) passes."""
    low, high = reach
    if isinstance(pair, SphereOnPlane | CylinderOnPlane):
        middle = (*(low + high)[:2] / 2, -thick / 4)
        return [Solid.box((*(high - low)[:2], thick / 2)).placed(middle)]
    if isinstance(pair, SphereOnSphere):
        return [Solid.ball(float(pair.other_radius))]
    if isinstance(pair, SphereInCylinder | JournalInBush):
        inner = round_radius(pair) + float(pair.clearance)
        ends = (low[2], high[2]) if isinstance(pair, SphereInCylinder) else (-pair.length / 2, pair.length / 2)
        return [open_tube(inner, float(ends[0]), float(ends[1]))]
    if isinstance(pair, RollerOnCurve):
        return [plate_of_outline(curve_points(pair)[:-1, :2], 1.5 * thick)]
    if isinstance(pair, WheelOnRoad):
        return [_road_surface(pair.road, low[1], high[1])]
    return []


def _round_part(pair, thick):
    radius = round_radius(pair)
    if radius <= 0:
        return []
    if isinstance(pair, CylinderOnPlane | JournalInBush):
        return [Solid.cylinder(radius, float(pair.length))]
    if isinstance(pair, RollerOnCurve):
        return [Solid.cylinder(radius, 2.0 * thick)]
    return [Solid.ball(radius)]


def surface_of_grid(points: np.ndarray) -> Solid:
    """A sheet through points (n, m, 3) of a grid, with smooth normals."""
    n, m = points.shape[:2]
    normals = np.cross(np.gradient(points, axis=0), np.gradient(points, axis=1)).reshape(-1, 3)
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    number = np.arange(n * m).reshape(n, m)
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    return Solid(points.reshape(-1, 3), normals, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


def open_tube(radius: float, low: float, high: float) -> Solid:
    """The wall of a tube about the axis z, between two heights."""
    angle = np.linspace(0.0, 2 * np.pi, _AROUND + 1)
    ring = radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    return surface_of_grid(np.stack([ring + [0.0, 0.0, low], ring + [0.0, 0.0, high]], axis=1))


def plate_of_outline(outline: np.ndarray, thickness: float) -> Solid:
    """A plate about the plane x y within an outline (n, 2); of a clockwise one, a hole, only the wall."""
    closed = np.concatenate([outline, outline[:1]])
    sides = [np.column_stack([closed, np.full(len(closed), z)]) for z in (-thickness / 2, thickness / 2)]
    wall = surface_of_grid(np.stack(sides, axis=1))
    x, y = closed.T
    if np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]) < 0:
        return wall
    faces = Delaunay(outline).simplices
    faces = faces[_is_within(outline, outline[faces].mean(axis=1))]
    up = np.tile([0.0, 0.0, 1.0], (len(outline), 1))
    caps = [Solid(side[:-1], sign * up, faces) for side, sign in zip(sides, (-1.0, 1.0), strict=True)]
    return join_solids([wall, *caps])


def _is_within(outline, points):
    """True for points (k, 2) within a polygon (n, 2): a ray from them crosses it an odd number of times."""
    a, b, (x, y) = outline, np.roll(outline, -1, axis=0), points.T[:, :, None]
    crosses = (a[:, 1] > y) != (b[:, 1] > y)
    rise = np.where(a[:, 1] == b[:, 1], 1.0, b[:, 1] - a[:, 1])
    at = a[:, 0] + (y - a[:, 1]) * (b[:, 0] - a[:, 0]) / rise
    return np.sum(crosses & (at > x), axis=1) % 2 == 1


def _road_surface(road, low, high):
    """The sheet of a height field over its length, as wide as it is used."""
    x = np.linspace(float(road.x[0]), float(road.x[-1]), _ALONG + 1)
    y = np.linspace(low, high, _ACROSS + 1)
    heights = np.asarray(jax.vmap(jax.vmap(road, (None, 0)), (0, None))(x, y))
    return surface_of_grid(np.stack([*np.meshgrid(x, y, indexing="ij"), heights], axis=2))
