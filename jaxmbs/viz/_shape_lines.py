"""Lines of shapes in space: surfaces, wheels, threads, and points of contact."""

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import jax
import numpy as np

from ..drawings import Ball, Box, Cylinder, Gear, HeightSurface, Marks, Outline, Path, Plane, Rail, Tube, Wheel
from ._gear_outline import gear_outline
from ._things import ShapePoses, Thing, along_trajectory, place_of_shape, thread_courses

_ROUND, _ALONG = 48, 160  # points of a circle, and along a surface


class RoundLines(NamedTuple):
    """A round part: rims (T, 2, n, 3) at its ends, their centres (T, 2, 3), two radii (T, 2, 3) across the axis."""

    rims: np.ndarray
    centres: np.ndarray
    radii: np.ndarray

    def project(self, k: int, look) -> np.ndarray:
        """Points (n, 2) of a line along both rims and both edges of the picture, broken by NaN."""
        (u, v), ends = look(self.radii[k]), look(self.centres[k])
        along = ends[1] - ends[0]
        turn = np.arctan2(_across(along, v), _across(along, u))  # where the rim runs along the axis
        edge = np.cos(turn) * u + np.sin(turn) * v
        gap = np.full((1, 2), np.nan)
        first, second = look(self.rims[k])
        return np.concatenate([first, gap, second, gap, ends + edge, gap, ends - edge])


def _across(a, b):
    return a[0] * b[1] - a[1] * b[0]


class ThingLines(NamedTuple):
    """A thing at all instants of a trajectory.

    Attributes:
        name: of the thing.
        lines: of its shapes, (T, k, 3) each [m]; balls: (centres (T, 3), radius) of its balls; rounds: of its
            cylinders, tubes, wheels and gears.
        threads: (T, k, 3) each, points along its threads [m].
        marks: (T, k, 3) points of contact [m], NaN apart.
    """

    name: str
    lines: list
    balls: list
    rounds: list
    threads: list
    marks: np.ndarray

    @property
    def extent(self) -> float:
        """The largest edge of the boxes of its shapes [m]."""
        sizes = [np.ptp(line[0], axis=0).max() for line in self.lines] + [2.0 * radius for _, radius in self.balls]
        sizes += [np.ptp(shape.rims[0].reshape(-1, 3), axis=0).max() for shape in self.rounds]
        return float(max(sizes, default=0.0))


def thing_lines(found: Iterable[Thing], film) -> list[ThingLines]:
    """Lines of all things that have other shapes than symbols."""
    return [_lines_of(thing, film) for thing in found if len(thing.symbols) < len(thing.shapes)]


def _lines_of(thing, film):
    lines, balls, rounds = [], [], []
    for shape in thing.shapes:
        if not hasattr(shape, "frame") or getattr(shape, "radius", 1.0) <= 0:  # threads, marks, points
            continue
        place = place_of_shape(thing, shape, film)
        if type(shape) in _LINES:
            lines += [place.in_world(line) for line in _LINES[type(shape)](shape, place)]
        elif type(shape) in _LENGTHS:
            rounds.append(_round(shape, place))
        elif isinstance(shape, Ball):
            balls.append((place.x, float(shape.radius)))
    threads = [thread_courses(thing, thread, film)[1] for thread in thing.threads]
    marks = [_marks(thing, shape, film) for shape in thing.shapes if isinstance(shape, Marks)]
    marks = np.concatenate([np.zeros((len(film.ts), 0, 3)), *marks], 1)
    return ThingLines(thing.name, lines, balls, rounds, threads, marks)


def _marks(thing, shape, film):
    """World points (T, k, 3) where the two frames touch."""
    a, b = thing.frames[:2]
    A, x = film.R[:, a], film.x[:, a]
    R = np.einsum("tji,tjk->tik", A, film.R[:, b])
    points = np.asarray(along_trajectory(shape.points, R, film.position_in_frame(a, b)))
    return x[:, None] + np.einsum("tij,tkj->tki", A, points)


def _round(shape, at: ShapePoses) -> RoundLines:
    """Lines of a shape about an axis."""
    low, high = _LENGTHS[type(shape)](shape, at)
    first = np.cross(at.axis, np.eye(3)[np.argmin(np.abs(at.axis))])
    first /= np.linalg.norm(first)
    across = np.stack([first, np.cross(at.axis, first)])
    angle, radius = np.linspace(0.0, 2 * np.pi, _ROUND + 1), float(shape.radius)
    rim = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    if isinstance(shape, Gear):
        rim, across = gear_outline(shape), np.eye(3)[:2]
        rim, radius = np.concatenate([rim, rim[:1]]), np.max(np.linalg.norm(rim, axis=1))
    ends = np.array([low, high], float)[:, None] * at.axis
    rims = np.stack([at.in_world(end + rim @ across) for end in ends], axis=1)
    return RoundLines(rims, at.in_world(ends), at.in_world(radius * across) - at.x[:, None])


def _middle(length):
    return -float(length) / 2, float(length) / 2


#: Ends of round shapes along their axis [m].
_LENGTHS: dict[type, Callable[[Any, ShapePoses], tuple]] = {
    Cylinder: lambda shape, at: _middle(shape.length),
    Gear: lambda shape, at: _middle(shape.width),
    Tube: lambda shape, at: (at.low[2], at.high[2]) if shape.length is None else _middle(shape.length),
    Wheel: lambda shape, at: _middle(shape.width),
}


def _plane(shape: Plane, at: ShapePoses) -> list:
    (a, b), (c, d) = at.low[:2], at.high[:2]
    return [np.array([(a, b, 0.0), (c, b, 0.0), (c, d, 0.0), (a, d, 0.0), (a, b, 0.0)])]


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
    Box: _box,
    HeightSurface: _profile,
    Outline: _outline,
    Path: lambda shape, at: [np.asarray(shape.points)],
    Plane: _plane,
    Rail: lambda shape, at: [np.outer(at.reach, at.axis)],
}
