"""Geometry of a cable over circles in space: tangent points, spans, arcs, and its length as a function of poses.

Every element of the path is a circle, about whose axis the cable turns in the positive sense on its way; a point is
one of radius and axis zero.  All elements and all spans are treated at once, in components (`math/_vector.py`).
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..math._vector import Vectors, cross, dot, norm, norm_and_unit, unit
from ..runtime import gather_static
from ._cable_bypass import Bypass, bypass
from ._common_tangent import common_tangents

#: Wraps between minus this angle and a full turn less it are told apart from the directions alone [rad].
LEAST_WRAP = np.pi / 2
#: Cosine of the angle between a span and the radius at its end that still counts as a right one.
_TANGENT = 1e-4


#: Sine of the angle between the neighbours of a sphere, seen from its centre, below which they are in line with it.
_IN_LINE = 1e-6


class PathLayout(NamedTuple):
    """Static parts of a path.

    Attributes:
        kinds: of each element, "point", "sheave", "cylinder" or "sphere".
        is_closed: True if the last element is followed by the first.
    """

    kinds: tuple[str, ...]
    is_closed: bool

    def elements(self, *kinds: str) -> np.ndarray:
        """Ones (n,) at elements of these kinds, zero at others."""
        return np.array([float(kind in kinds) for kind in self.kinds])

    @property
    def circles(self) -> np.ndarray:
        """Indices of the elements that are no points."""
        return np.flatnonzero([kind != "point" for kind in self.kinds])

    @property
    def has_two_circles(self) -> bool:
        """True if a span joins two circles."""
        following = self.kinds[1:] + self.kinds[:1] * self.is_closed
        return any("point" not in pair for pair in zip(self.kinds, following, strict=False))

    @property
    def free_wheels(self) -> np.ndarray:
        """Indices of the circles between two points, which the cable may leave."""
        n = len(self.kinds)
        beside = [(self.kinds[k - 1], self.kinds[(k + 1) % n]) for k in range(n)]
        return np.array([k for k in self.circles if beside[k] == ("point", "point")], int)

    def free_wheels_of(self, kind: str) -> np.ndarray:
        """Those of a kind."""
        return np.array([k for k in self.free_wheels if self.kinds[k] == kind], int)

    @property
    def before_free_wheels(self) -> np.ndarray:
        """Indices of the points before them, and of the spans from these."""
        return (self.free_wheels - 1) % len(self.kinds)

    @property
    def after_free_wheels(self) -> np.ndarray:
        """Indices of the points after them."""
        return (self.free_wheels + 1) % len(self.kinds)

    @property
    def beside_free_wheels(self) -> np.ndarray:
        """Signs (n, k) of the elements after and before each of them."""
        after, before = (np.eye(len(self.kinds))[:, k] for k in (self.after_free_wheels, self.before_free_wheels))
        return after - before

    def at_spans(self, values, default: float):
        """Values (k,) of the free wheels at both of their spans (m,), the default at others; of a pytree."""
        return self._spread(values, default, self.num_spans, (self.before_free_wheels, self.free_wheels))

    def at_elements(self, values, default: float):
        """Values (k,) of the free wheels among those of all elements (n,), the default at others; of a pytree."""
        return self._spread(values, default, len(self.kinds), (self.free_wheels,))

    def _spread(self, values, default, size, places):
        number = len(self.free_wheels)
        source = np.full(size, number)
        for place in places:
            source[place] = np.arange(number)
        more = lambda x: jnp.concatenate([x, jnp.full((1, *x.shape[1:]), default, x.dtype)])
        return jax.tree.map(lambda x: gather_static(more(x), source), values)

    @property
    def leaves(self) -> np.ndarray:
        """Ones (m,) where a span begins at a circle."""
        return 1.0 - self.ends(self.elements("point"))[0]

    @property
    def begins(self) -> np.ndarray:
        """Ones (n, m) at the element where each span begins."""
        return np.eye(len(self.kinds))[:, : self.num_spans]

    @property
    def reaches(self) -> np.ndarray:
        """Ones (n, m) at the element that each span reaches."""
        return np.roll(np.eye(len(self.kinds)), -1, axis=1)[:, : self.num_spans]

    @property
    def num_spans(self) -> int:
        """Number m of spans."""
        return len(self.kinds) - (not self.is_closed)

    def ends(self, values):
        """Values (m,) of the elements where each span begins, and of those where it ends; of a pytree with leaves
        (n,)."""
        if self.is_closed:
            return values, jax.tree.map(lambda v: jnp.roll(v, -1, axis=0), values)
        return jax.tree.map(lambda v: v[:-1], values), jax.tree.map(lambda v: v[1:], values)

    def after(self, spans):
        """Values (n,) of the span that begins at each element, zero where there is none; of a pytree, leaves (m,)."""
        return spans if self.is_closed else jax.tree.map(lambda v: _padded(v, 0, 1), spans)

    def before(self, spans):
        """Values (n,) of the span that ends at each element, zero where there is none; of a pytree, leaves (m,)."""
        if self.is_closed:
            return jax.tree.map(lambda v: jnp.roll(v, 1, axis=0), spans)
        return jax.tree.map(lambda v: _padded(v, 1, 0), spans)

    def inner(self, values):
        """Values of the elements between two spans; of a pytree, leaves (n,)."""
        return values if self.is_closed else jax.tree.map(lambda v: v[1:-1], values)

    def of_inner(self, before, after):
        """Values of the span that ends at each inner element, and of the one that begins there; leaves (m,)."""
        if self.is_closed:
            return self.before(before), after
        return jax.tree.map(lambda v: v[:-1], before), jax.tree.map(lambda v: v[1:], after)

    def from_inner(self, values):
        """Values (n,) of all elements from those of the inner ones, zero at ends."""
        return values if self.is_closed else jnp.pad(values, (1, 1))


def _padded(values, before, after):
    """Values with zeros before and after them."""
    return jnp.pad(values, ((before, after), *[(0, 0)] * (values.ndim - 1)))


class Circles(NamedTuple):
    """The elements of a path in world axes.

    Attributes:
        place: centres (n,) [m].
        radius: (n,), zero at points [m].
        axis: unit vectors (n,), zero at points.
        turns: (n,) whole turns beside the wrap; None where they are not needed.
    """

    place: Vectors
    radius: Array
    axis: Vectors
    turns: Any


class CablePath(NamedTuple):
    """A cable's way at one instant.

    Attributes:
        elements: where each span begins, and where it ends, `Circles` (m,) without turns.
        start, end: (m,) points where the spans leave an element and reach the next [m].
        spans: (m,) lengths of the spans [m].
        directions: (m,) unit vectors along them.
        wrap: (n,) angle about each element, zero at points; negative where the cable has left it [rad].
        arc: (n,) length on each element [m].
        normals: unit vectors (m,) from the axes to both ends of the spans, zero at points.
        axes: unit vectors (n,) about which the cable turns, zero at points.
        bypass: straight ways past the wheels between two points; None where no wheel is.

    All but the length are those of the way over all wheels, also those that the cable has left.
    """

    elements: tuple[Circles, Circles]
    start: Vectors
    end: Vectors
    spans: Array
    directions: Vectors
    wrap: Array
    arc: Array
    normals: tuple[Vectors, Vectors]
    axes: Vectors
    bypass: Bypass | None

    @property
    def is_tangent(self) -> Array:
        """True (m,) where a span touches its circles; false where none does, as from a point within a circle."""
        return self.tangent_margin >= 0

    @property
    def tangent_margin(self) -> Array:
        """Length (m,) by which a span may miss the tangents of its circles, less that by which it does [m]."""
        most = _TANGENT * jnp.where(self.spans > 0, self.spans, 1.0)
        across = [jnp.abs(dot(normal, self.end - self.start)) for normal in self.normals]
        return most - jnp.maximum(*across)

    @property
    def length(self) -> Array:
        """Whole length, straight past wheels that it has left [m]."""
        over = jnp.sum(self.spans) + jnp.sum(self.arc)
        return over if self.bypass is None else over - self.bypass.saved

    def touching_points(self, layout: PathLayout) -> tuple[Vectors, Vectors]:
        """Beginnings and ends (m,) of the spans; past a wheel that the cable has left both are the point of the
        straight way that is next to them."""
        if self.bypass is None:
            return self.start, self.end
        own, past = self.bypass.wheel, self.bypass.directions
        first, middle = (
            jax.tree.map(lambda x, k=k: gather_static(x, k), points)
            for points, k in ((self.start, layout.before_free_wheels), (self.end, layout.before_free_wheels))
        )
        point = first + past * dot(past, middle - first)
        mixed = []
        for ends, k in ((self.start, layout.free_wheels), (self.end, layout.before_free_wheels)):
            here = jax.tree.map(lambda x, k=k: gather_static(x, k), ends)
            new = here * own + point * (1.0 - own)
            mixed.append(jax.tree.map(lambda x, y, k=k: x.at[k].set(y), ends, new))
        return mixed[0], mixed[1]

    def mixed(self, layout: PathLayout) -> tuple[Array, Array, Vectors]:
        """Lengths of spans (m,) and arcs (n,), and directions (m,) of spans, of the way that the cable takes."""
        if self.bypass is None:
            return self.spans, self.arc, self.directions
        own, other = layout.at_spans(self.bypass.wheel, 1.0), layout.at_spans(self.bypass.direct, 0.0)
        half = layout.at_spans(self.bypass.length / 2, 0.0)
        arc = self.arc * layout.at_elements(self.bypass.wheel, 1.0)
        along = layout.at_spans(self.bypass.directions, 0.0)
        return self.spans * own + half * other, arc, self.directions * own + along * other


def cable_path(layout: PathLayout, circles: Circles) -> CablePath:
    """The path over circles."""
    if "sphere" in layout.kinds:
        circles = circles._replace(axis=_axes_on_spheres(layout, circles))
    first, second = layout.ends(circles._replace(turns=None))
    leaving, arriving = common_tangents(first, second, None if layout.has_two_circles else layout.leaves)
    start, end = first.place + leaving * first.radius, second.place + arriving * second.radius
    wrap = _wraps(layout, circles, arriving, leaving)
    arc = circles.radius * wrap
    if "cylinder" in layout.kinds:
        start, end, arc = _climb_cylinders(layout, circles, start, end, arc)
    spans, directions = norm_and_unit(end - start)
    past = bypass(layout, circles.place, spans, arc, wrap) if len(layout.free_wheels) else None
    normals = leaving, arriving
    return CablePath((first, second), start, end, spans, directions, wrap, arc, normals, circles.axis, past)


def _axes_on_spheres(layout, circles):
    """Axes with those of spheres at right angles to the plane of their centre and the two neighbours, on the side of
    their own axis: the geodesic is in that plane."""
    own, (first, second) = layout.elements("sphere"), layout.ends(circles.place)
    span = second - first
    before, after = layout.before(span), layout.after(span)
    normal = cross(after, before)
    side = jnp.where(dot(normal, circles.axis) < 0, -own, own)
    # in line with the centre the neighbours have no plane: it is that of the line and the given axis
    least = _IN_LINE**2 * dot(before, before) * dot(after, after)
    is_line = dot(normal, normal) <= least
    along = unit(after)
    upright = circles.axis - along * dot(along, circles.axis)
    across = unit(_where(is_line, upright, normal * side)) * own
    return across + circles.axis * (1.0 - own)


def _where(condition, a, b):
    wide = lambda x: condition.reshape(condition.shape + (1,) * (x.ndim - condition.ndim))
    return jax.tree.map(lambda x, y: jnp.where(wide(x), x, y), a, b)


def _wraps(layout, circles, arriving, leaving):
    """Wrap angles (n,) between the normals (m,) at the ends and at the beginnings of spans."""
    inner, points = layout.inner(circles), layout.inner(layout.elements("point"))
    arriving, leaving = layout.of_inner(arriving, leaving)
    angle = jnp.arctan2(dot(inner.axis, cross(arriving, leaving)), dot(arriving, leaving) + points)
    angle = jnp.where(angle < -LEAST_WRAP, angle + 2 * np.pi, angle)
    return layout.from_inner(angle + 2 * np.pi * inner.turns)


def _climb_cylinders(layout, circles, start, end, arc):
    """Ends of spans and arcs with helices on cylinders: straight lines where their surfaces are unrolled."""
    axis = circles.axis * layout.elements("cylinder")
    on, off = layout.before(end), layout.after(start)  # of each element, as are the points before and after it
    far = layout.before(start), layout.after(end)
    low, high = (dot(axis, point - circles.place) for point in far)
    before, after = (norm(d - axis * dot(axis, d)) for d in (on - far[0], far[1] - off))
    whole = before + arc + after
    slope = (high - low) / jnp.where(whole > 0, whole, 1.0)
    climb_on, climb_off = axis * (low + slope * before), axis * (low + slope * (before + arc))
    start = start + layout.ends(climb_off)[0]
    end = end + layout.ends(climb_on)[1]
    return start, end, arc * jnp.sqrt(1 + slope**2)
