"""Lines of shapes in space: surfaces, wheels, threads, and points of contact."""

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import jax
import numpy as np

from ..drawings import Ball, Box, Cylinder, HeightSurface, Marks, Outline, Path, Plane, Tube, Wheel
from ._things import ShapePoses, Thing, along_trajectory, place_of_shape, thread_courses

_ROUND, _ALONG = 48, 160  # points of a circle, and along a surface


class ThingLines(NamedTuple):
    """A thing at all instants of a trajectory.

    Attributes:
        name: of the thing.
        lines: of its shapes, (T, k, 3) each [m]; balls: (centres (T, 3), radius) of its balls.
        threads: (T, k, 3) each, points along its threads [m].
        marks: (T, k, 3) points of contact [m], NaN apart.
    """

    name: str
    lines: list
    balls: list
    threads: list
    marks: np.ndarray


def thing_lines(found: Iterable[Thing], film) -> list[ThingLines]:
    """Lines of all things that have other shapes than symbols."""
    return [_lines_of(thing, film) for thing in found if len(thing.symbols) < len(thing.shapes)]


def _lines_of(thing, film):
    lines, balls = [], []
    for shape in thing.shapes:
        if type(shape) in _LINES and getattr(shape, "radius", 1.0) > 0:
            place = place_of_shape(thing, shape, film)
            lines += [place.in_world(line) for line in _LINES[type(shape)](shape, place)]
            balls += [(place.x, float(shape.radius))] if type(shape) is Ball else []
    threads = [thread_courses(thing, thread, film)[1] for thread in thing.threads]
    marks = [_marks(thing, shape, film) for shape in thing.shapes if isinstance(shape, Marks)]
    return ThingLines(thing.name, lines, balls, threads, np.concatenate([np.zeros((len(film.ts), 0, 3)), *marks], 1))


def _marks(thing, shape, film):
    """World points (T, k, 3) where the two frames touch."""
    a, b = thing.frames[:2]
    A, x = film.R[:, a], film.x[:, a]
    R = np.einsum("tji,tjk->tik", A, film.R[:, b])
    points = np.asarray(along_trajectory(shape.points, R, film.position_in_frame(a, b)))
    return x[:, None] + np.einsum("tij,tkj->tki", A, points)


def circle(centre: Any, axis: Any, radius: float) -> np.ndarray:
    """Points (..., n, 3) of a circle about centres (..., 3) and axes (..., 3)."""
    axis = np.asarray(axis) / np.linalg.norm(axis, axis=-1, keepdims=True)
    other = np.eye(3)[np.argmin(np.abs(axis), axis=-1)]
    first = np.cross(axis, other)
    first = first / np.linalg.norm(first, axis=-1, keepdims=True)
    angle = np.linspace(0.0, 2 * np.pi, _ROUND + 1)[:, None]
    turned = np.cos(angle) * first[..., None, :] + np.sin(angle) * np.cross(axis, first)[..., None, :]
    return np.asarray(centre)[..., None, :] + radius * turned


def _around(radius, low, high, axis=(0.0, 0.0, 1.0)):
    """A line (k, 3) around both ends of a tube about an axis, and along it."""
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    ends = np.array([low, high], float)[:, None] * axis
    return np.concatenate(circle(ends, np.array([axis] * 2), float(radius)))


def _plane(shape: Plane, at: ShapePoses) -> list:
    (a, b), (c, d) = at.low[:2], at.high[:2]
    return [np.array([(a, b, 0.0), (c, b, 0.0), (c, d, 0.0), (a, d, 0.0), (a, b, 0.0)])]


def _tube(shape: Tube, at: ShapePoses) -> list:
    low, high = (at.low[2], at.high[2]) if shape.length is None else (-shape.length / 2, shape.length / 2)
    return [_around(shape.radius, low, high)]


def _box(shape: Box, at: ShapePoses) -> list:
    """One line through the corners of a box, along all of its edges."""
    order = np.array([0, 1, 3, 2, 0, 4, 5, 7, 6, 4, 5, 1, 3, 7, 6, 2])
    return [((np.indices((2, 2, 2)).reshape(3, -1).T - 0.5) * np.asarray(shape.size))[order]]


def _outline(shape: Outline, at: ShapePoses) -> list:
    closed = np.concatenate([np.asarray(shape.points), np.asarray(shape.points)[:1]])
    return [np.column_stack([closed, np.zeros(len(closed))])]


def _profile(shape: HeightSurface, at: ShapePoses) -> list:
    """The surface under the first of the other frames."""
    first, last = map(float, shape.ends)
    x, across = np.linspace(first, last, _ALONG), at.others[:, 0, 1]
    heights = np.asarray(jax.vmap(jax.vmap(shape.height, (0, None)), (None, 0))(x, across))
    parts = np.broadcast_to(x, heights.shape), np.broadcast_to(across[:, None], heights.shape), heights
    return [np.stack(parts, axis=2)]


#: Lines (k, 3) or (T, k, 3) of a shape in the axes of its frame.
_LINES: dict[type, Callable[[Any, ShapePoses], list]] = {
    Ball: lambda shape, at: [],
    Box: _box,
    Cylinder: lambda s, at: [_around(s.radius, -s.length / 2, s.length / 2, s.axis)],
    HeightSurface: _profile,
    Outline: _outline,
    Path: lambda shape, at: [np.asarray(shape.points)],
    Plane: _plane,
    Tube: _tube,
    Wheel: lambda shape, at: [circle(np.zeros(3), np.asarray(shape.axis, float), float(shape.radius))],
}
