"""Geometry of a cable over circles in space: tangent points, spans, arcs, and its length as a function of poses.

Every element of the path is a circle; a point is one of radius zero.  `sense` is +1 where the cable turns about the
axis of its circle in the positive sense on the way from the first element to the last, else -1.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..math._linalg import direction, safe_norm

#: Rounds of Newton of a span between two circles, from the tangent of parallel axes; the derivative passes the last
#: two alone, which makes derivatives up to the third exact.
_FROZEN, _DIFFERENTIATED = 3, 2
#: Wraps between minus this angle and a full turn less it are told apart from the directions alone [rad].
_LEAST_WRAP = np.pi / 2


class Layout(NamedTuple):
    """Static parts of a path.

    Attributes:
        kinds: of each element, "point", "sheave", "cylinder" or "sphere".
        senses: +1 or -1 of each element.
        turns: whole turns about each element beside the wrap.
        is_closed: True if the last element is followed by the first.
    """

    kinds: tuple[str, ...]
    senses: tuple[int, ...]
    turns: tuple[int, ...]
    is_closed: bool

    @property
    def circles(self) -> np.ndarray:
        """Indices of the elements that are no points."""
        return np.flatnonzero([kind != "point" for kind in self.kinds])

    @property
    def spans(self) -> tuple[np.ndarray, np.ndarray]:
        """(m,) elements where each span begins and ends."""
        n = len(self.kinds)
        first = np.arange(n if self.is_closed else n - 1)
        return first, (first + 1) % n


class CablePath(NamedTuple):
    """A cable's way at one instant.

    Attributes:
        start, end: (m, 3) points where the spans leave an element and reach the next [m].
        wrap: (n,) angle about each element, zero at points; negative where the cable has left it [rad].
        arc: (n,) length on each element [m].
    """

    start: Array
    end: Array
    wrap: Array
    arc: Array

    @property
    def spans(self) -> Array:
        """Lengths (m,) of the spans [m]."""
        return jax.vmap(safe_norm)(self.end - self.start)

    @property
    def directions(self) -> Array:
        """Unit vectors (m, 3) along the spans."""
        return jax.vmap(direction)(self.end - self.start)

    @property
    def length(self) -> Array:
        """Whole length [m]."""
        return jnp.sum(self.spans) + jnp.sum(self.arc)


def cable_path(layout: Layout, radii: Array, axes: Array, x: Array) -> CablePath:
    """The path through circles at x (n, 3) of radii (n,) about unit axes (n, 3) in world axes; zero at points."""
    axes = _axes_of_spheres(layout, axes, x)
    first, second = layout.spans
    sense = np.asarray(layout.senses, float)
    leaving = jax.vmap(_tangent)(x[second] - x[first], radii[first], axes[first], -sense[first])
    arriving = jax.vmap(_tangent)(x[first] - x[second], radii[second], axes[second], sense[second])
    both = np.flatnonzero([layout.kinds[a] != "point" != layout.kinds[b] for a, b in zip(first, second, strict=True)])
    if both.size:
        a, b = first[both], second[both]
        ends = ((x[a], radii[a], axes[a], -sense[a]), (x[b], radii[b], axes[b], sense[b]))
        one, other = jax.vmap(_common_tangent)(*ends)
        leaving, arriving = leaving.at[both].set(one), arriving.at[both].set(other)
    start, end = x[first] + radii[first, None] * leaving, x[second] + radii[second, None] * arriving
    wrap = _wraps(layout, axes, leaving, arriving)
    path = CablePath(start, end, wrap, radii * wrap)
    return _climb_cylinders(layout, axes, x, path) if "cylinder" in layout.kinds else path


def _axes_of_spheres(layout, axes, x):
    """Axes with those of spheres at right angles to the plane of their centre and the two neighbours, on the side of
    their own axis: the geodesic is in that plane."""
    own = np.flatnonzero([kind == "sphere" for kind in layout.kinds])
    if not own.size:
        return axes
    across = jnp.cross(x[own - 1] - x[own], x[own + 1] - x[own])
    normal = jax.vmap(direction)(across)
    is_opposite = jnp.sum(axes[own] * normal, axis=1, keepdims=True) < 0
    return axes.at[own].set(jnp.where(is_opposite, -normal, normal))


def _tangent(p, radius, axis, side):
    """Unit normal (3,) where the tangent from a point touches a circle; p (3,): the point from the centre.

    `n = (r p + side sqrt(d^2 - r^2) axis x p) / d^2` with p in the circle's plane, of length d.
    """
    p = p - jnp.dot(axis, p) * axis
    square = jnp.dot(p, p)
    square = jnp.where(square > 0, square, 1.0)
    free = square - radius**2
    reach = jnp.where(free > 0, jnp.sqrt(jnp.where(free > 0, free, 1.0)), 0.0)
    return (radius * p + side * reach * jnp.cross(axis, p)) / square


def _common_tangent(first, second):
    """Normals (3,) of two circles at the points where the span between them touches both."""
    frozen = lax.stop_gradient((first, second))
    (x, r, a, s), (y, q, b, z) = frozen
    same = -s * z * jnp.sign(jnp.dot(a, b))  # +1 for an outer tangent of parallel axes, -1 for a crossing one
    n = _tangent(y - x, r - same * q, a, s)
    m = direction(same * (n - jnp.dot(n, b) * b))
    for _ in range(_FROZEN):
        n, m = _newton(frozen, n, m)
    n, m = lax.stop_gradient((n, m))
    n, m = (direction(v - jnp.dot(v, axis) * axis) for v, axis in ((n, first[2]), (m, second[2])))
    for _ in range(_DIFFERENTIATED):
        n, m = _newton((first, second), n, m)
    return n, m


def _newton(ends, n, m):
    """Normals turned so that the span is at right angles to both: Newton in the two angles."""
    (x, r, a, _), (y, q, b, _) = ends
    u, v = jnp.cross(a, n), jnp.cross(b, m)
    span = y + q * m - x - r * n
    wrong = (jnp.dot(n, span), jnp.dot(m, span))
    matrix = ((jnp.dot(u, span), q * jnp.dot(n, v)), (-r * jnp.dot(m, u), jnp.dot(v, span)))
    det = matrix[0][0] * matrix[1][1] - matrix[0][1] * matrix[1][0]
    det = jnp.where(det == 0, 1.0, det)
    one = (matrix[0][1] * wrong[1] - matrix[1][1] * wrong[0]) / det
    other = (matrix[1][0] * wrong[0] - matrix[0][0] * wrong[1]) / det
    return direction(n + one * u), direction(m + other * v)


def _wraps(layout, axes, leaving, arriving):
    """Wrap angles (n,); a cable on a circle arrives and leaves there."""
    own = layout.circles
    if not own.size:
        return jnp.zeros(len(layout.kinds), leaving.dtype)
    sense = np.asarray(layout.senses, float)[own]
    before, after = arriving[own - 1], leaving[own]  # the span before element k is span k - 1
    sine = jnp.sum(axes[own] * jnp.cross(before, after), axis=1)
    angle = sense * jnp.arctan2(sine, jnp.sum(before * after, axis=1))
    angle = jnp.where(angle < -_LEAST_WRAP, angle + 2 * np.pi, angle)
    return jnp.zeros(len(layout.kinds), angle.dtype).at[own].set(angle + 2 * np.pi * np.asarray(layout.turns)[own])


def _climb_cylinders(layout, axes, x, path):
    """The path with helices on its cylinders: straight lines where their surfaces are unrolled."""
    own = np.flatnonzero([kind == "cylinder" for kind in layout.kinds])
    axis, start, end = axes[own], path.start[own - 1], path.end[own]
    low, high = (jnp.sum(axis * (point - x[own]), axis=1) for point in (start, end))
    flat = lambda a, b: jax.vmap(lambda d, n: safe_norm(d - jnp.dot(n, d) * n))(b - a, axis)  # noqa: E731
    before, after, arc = flat(start, path.end[own - 1]), flat(path.start[own], end), path.arc[own]
    slope = (high - low) / (before + arc + after)
    on = path.end.at[own - 1].add((low + slope * before)[:, None] * axis)
    off = path.start.at[own].add((low + slope * (before + arc))[:, None] * axis)
    return path._replace(start=off, end=on, arc=path.arc.at[own].set(arc * jnp.sqrt(1 + slope**2)))
