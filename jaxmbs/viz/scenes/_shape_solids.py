"""Solids of shapes: planes, tubes, wheels, cams, roads, and the round parts on them."""

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import jax
import numpy as np
from scipy.spatial import Delaunay

from ...drawings import Ball, Box, Cylinder, Gear, HeightSurface, Outline, Path, Plane, Rail, Tube, Wheel
from .._gear_outline import gear_outline
from .._things import ShapePoses, Thing, place_of_shape
from ._solids import Solid, join_solids, rotation_to_axis, sweep_tube

_AROUND, _ALONG, _ACROSS = 48, 96, 12  # points around a tube, along and across a road
_SURFACES = (HeightSurface, Outline, Plane, Tube)  # through which one sees what is on them


class ShapeSolid(NamedTuple):
    """A solid in the axes of a frame, and its colour, "" for that of the body."""

    name: str
    frame: int
    solid: Solid
    is_clear: bool
    color: str


def shape_solids(found: Iterable[Thing], film, thick: float) -> list[ShapeSolid]:
    """Solids of the shapes of all things along a trajectory; `thick` [m] is that of what has no thickness."""
    return [
        ShapeSolid(thing.name, thing.frames[shape.frame], solid, _is_clear(shape), getattr(shape, "color", ""))
        for thing in found
        for shape in thing.shapes
        if type(shape) in _SOLIDS and getattr(shape, "radius", 1.0) > 0
        for solid in [_SOLIDS[type(shape)](shape, place_of_shape(thing, shape, film), thick)]
    ]


def solid_corners(found: list[ShapeSolid], film) -> list[np.ndarray]:
    """Points (n, 3) in the world that the solids reach: corners of surfaces, ends of round parts."""
    cube, star, points = np.indices((2, 2, 2)).reshape(3, -1).T * 2 - 1, np.concatenate([np.eye(3), -np.eye(3)]), []
    for _, frame, solid, is_clear, _ in found:
        low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
        places = (low + high) / 2 + (cube if is_clear else star) * (high - low) / 2
        points.append((np.einsum("tij,kj->tki", film.R[:, frame], places) + film.x[:, None, frame]).reshape(-1, 3))
    return points


def _is_clear(shape):
    return isinstance(shape, _SURFACES) or getattr(shape, "is_clear", False)


def _plane(shape: Plane, at: ShapePoses, thick: float) -> Solid:
    middle, size = (at.low + at.high)[:2] / 2, (at.high - at.low)[:2]
    return Solid.box((*size, thick / 2)).placed((*middle, -thick / 4))


def _tube(shape: Tube, at: ShapePoses, thick: float) -> Solid:
    low, high = (at.low[2], at.high[2]) if shape.length is None else (-shape.length / 2, shape.length / 2)
    return open_tube(float(shape.radius), float(low), float(high))


def _cylinder(shape: Any, at: ShapePoses, length: Any) -> Solid:
    return Solid.cylinder(float(shape.radius), float(length)).placed(rotation=rotation_to_axis(at.axis))


def _gear(shape: Gear, at: ShapePoses, thick: float) -> Solid:
    """A toothed plate; of a ring gear the wall of its teeth."""
    outline = gear_outline(shape)
    return plate_of_outline(outline[::-1] if shape.is_ring else outline, float(shape.width))


def _height_surface(shape: HeightSurface, at: ShapePoses, thick: float) -> Solid:
    """The sheet of a height field over its length, as wide as it is used."""
    first, last = map(float, shape.ends)
    x = np.linspace(first, last, _ALONG + 1)
    y = np.linspace(at.low[1], at.high[1], _ACROSS + 1)
    heights = np.asarray(jax.vmap(jax.vmap(shape.height, (None, 0)), (0, None))(x, y))
    return surface_of_grid(np.stack([*np.meshgrid(x, y, indexing="ij"), heights], axis=2))


#: Solids in the axes of the frame of a shape.
_SOLIDS: dict[type, Callable[[Any, ShapePoses, float], Solid]] = {
    Ball: lambda shape, at, thick: Solid.ball(float(shape.radius)),
    Box: lambda shape, at, thick: Solid.box(np.asarray(shape.size, float)),
    Cylinder: lambda shape, at, thick: _cylinder(shape, at, shape.length),
    Gear: _gear,
    HeightSurface: _height_surface,
    Outline: lambda shape, at, thick: plate_of_outline(np.asarray(shape.points, float), 1.5 * thick),
    Path: lambda shape, at, thick: sweep_tube(np.asarray(shape.points, float), 0.2 * thick),
    Plane: _plane,
    Rail: lambda shape, at, thick: sweep_tube(np.outer(at.reach, at.axis), 0.3 * thick),
    Tube: _tube,
    Wheel: lambda shape, at, thick: _cylinder(shape, at, shape.width if shape.width > 0 else 2.0 * thick),
}


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
