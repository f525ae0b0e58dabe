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

#: Rounds of Newton of a span between two circles, from the tangent of parallel axes.
_ROUNDS = 4
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
        normals: (m, 2, 3) unit vectors from the axes to both ends of the spans, zero at points.
    """

    start: Array
    end: Array
    wrap: Array
    arc: Array
    normals: Array

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
    sense = jnp.asarray(layout.senses, x.dtype)
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
    path = CablePath(start, end, wrap, radii * wrap, jnp.stack([leaving, arriving], axis=1))
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
    p = p - _dot(axis, p) * axis
    square = _dot(p, p)
    square = jnp.where(square > 0, square, 1.0)
    free = square - radius**2
    reach = jnp.where(free > 0, jnp.sqrt(jnp.where(free > 0, free, 1.0)), 0.0)
    return (radius * p + side * reach * jnp.cross(axis, p)) / square


@jax.custom_jvp
def _common_tangent(first, second):
    """Normals (3,) of two circles (centre, radius, axis, side) at the points where the span touches both."""
    (x, r, a, s), (y, q, b, z) = first, second
    same = -s * z * jnp.sign(_dot(a, b))  # +1 for an outer tangent of parallel axes, -1 for a crossing one
    n = _tangent(y - x, r - same * q, a, s)
    m = direction(same * (n - _dot(n, b) * b))
    u, v = jnp.cross(a, n), jnp.cross(b, m)
    one, other = _normal_angles(_Planes(*(_dot(*pair) for pair in _pairs(y - x, n, u, m, v))), r, q)
    return one[0] * n + one[1] * u, other[0] * m + other[1] * v


class _Planes(NamedTuple):
    """Products of the vector p between two centres and the axes n, u and m, v of the planes of the circles."""

    pn: Array
    pu: Array
    pm: Array
    pv: Array
    nm: Array
    nv: Array
    um: Array
    uv: Array


def _pairs(p, n, u, m, v):
    return (p, n), (p, u), (p, m), (p, v), (n, m), (n, v), (u, m), (u, v)


def _normal_angles(k, r, q):
    """Cosines and sines of the angles of both normals in their planes by Newton, numbers alone: quick to compile."""

    def turn(_, angles):
        (c, s), (d, e) = angles
        nm, nv = c * (k.nm * d + k.nv * e) + s * (k.um * d + k.uv * e), c * (k.nv * d - k.nm * e)
        nv = nv + s * (k.uv * d - k.um * e)
        um = c * (k.um * d + k.uv * e) - s * (k.nm * d + k.nv * e)
        wrong = c * k.pn + s * k.pu + q * nm - r, d * k.pm + e * k.pv + q - r * nm
        along = c * k.pu - s * k.pn + q * um, d * k.pv - e * k.pm - r * nv
        one, other = _turns(along[0], q * nv, -r * um, along[1], wrong)
        return _after_turn(c, s, one), _after_turn(d, e, other)

    start = (jnp.ones_like(k.nm), jnp.zeros_like(k.nm))
    return lax.fori_loop(0, _ROUNDS, turn, (start, start))


def _after_turn(c, s, angle):
    """Cosine and sine after a turn by about a small angle."""
    c, s = c - angle * s, s + angle * c
    scale = lax.rsqrt(c * c + s * s)
    return c * scale, s * scale


@_common_tangent.defjvp
def _common_tangent_rate(ends, rates):
    """By the conditions that the span is at right angles to both normals, so that derivatives of every order hold."""
    (x, r, a, _), (y, q, b, _) = ends
    (dx, dr, da, _), (dy, dq, db, _) = rates
    n, m = _common_tangent(*ends)
    u, v, span = jnp.cross(a, n), jnp.cross(b, m), y + q * m - x - r * n
    tilt, lean = -_dot(n, da) * a, -_dot(m, db) * b  # normals stay at right angles to their axes
    change = dy + dq * m + q * lean - dx - dr * n - r * tilt
    wrong = _dot(tilt, span) + _dot(n, change), _dot(lean, span) + _dot(m, change)
    one, other = _turns(_dot(u, span), q * _dot(n, v), -r * _dot(m, u), _dot(v, span), wrong)
    return (n, m), (tilt + one * u, lean + other * v)


def _turns(aa, ab, ba, bb, wrong):
    """Small turns of both normals that take away the projections of the span on them: a system of two equations."""
    det = aa * bb - ab * ba
    det = jnp.where(det == 0, 1.0, det)
    return (ab * wrong[1] - bb * wrong[0]) / det, (ba * wrong[0] - aa * wrong[1]) / det


def _dot(a, b):
    return jnp.sum(a * b, axis=-1)


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
