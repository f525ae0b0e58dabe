"""Tangents that two circles in space have in common, of many pairs at once.

The span from circle to circle is at right angles to the radius of either at the point where it touches.  Those are
two equations in the angles of the points of contact; between a point and a circle their solution is closed.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..math._vector import Vectors, cross, dot

#: Rounds of Newton of a span between two circles, from the tangent of parallel axes.
_ROUNDS = 4


class _Pairs(NamedTuple):
    """Pairs (m,) of circles: from the first centre to the second, radii, axes; points have neither."""

    span: Vectors
    r: Array
    q: Array
    a: Vectors
    b: Vectors


def common_tangents(first, second, leaves: np.ndarray | None) -> tuple[Vectors, Vectors]:
    """Unit vectors (m,) from the axes of `Circles` to the points where a cable leaves the first and arrives at the
    second, zero at points.

    Args:
        leaves: where at least one of each pair is a point, ones (m,) where the first is a circle; else None.
    """
    span = second.place - first.place
    if leaves is None:
        return _between_circles(_Pairs(span, first.radius, second.radius, first.axis, second.axis))
    side = 2.0 * leaves - 1.0
    normal = _tangent(span * side, first.radius + second.radius, first.axis + second.axis, -side)
    return normal * leaves, normal * (1.0 - leaves)


def _of_parallel_axes(k):
    """The tangents if axes are parallel."""
    same = jnp.sign(dot(k.a, k.b))  # +1 for an outer tangent, -1 for a crossing one
    return _tangent(k.span, k.r - same * k.q, k.a, -1.0), _tangent(-k.span, k.q - same * k.r, k.b, 1.0)


def _tangent(p, radius, axis, side):
    """Unit normal where the tangent from a point touches a circle; p: the point from the centre.

    `n = (r p + side sqrt(d^2 - r^2) axis x p) / d^2` with p in the circle's plane, of length d.
    """
    p = p - axis * dot(axis, p)
    square = dot(p, p)
    square = jnp.where(square > 0, square, 1.0)
    free = square - radius**2
    reach = jnp.where(free > 0, jnp.sqrt(jnp.where(free > 0, free, 1.0)), 0.0)
    return p * (radius / square) + cross(axis, p) * (side * reach / square)


@jax.custom_jvp
def _between_circles(k):
    """The tangents of any circles."""
    n, m = _of_parallel_axes(k)
    u, v = cross(k.a, n), cross(k.b, m)
    (c, s), (d, e) = _contact_angles(_Planes(*(dot(*pair) for pair in _products(k.span, n, u, m, v))), k.r, k.q)
    return n * c + u * s, m * d + v * e


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


def _products(p, n, u, m, v):
    return (p, n), (p, u), (p, m), (p, v), (n, m), (n, v), (u, m), (u, v)


def _contact_angles(k, r, q):
    """Cosines and sines of the angles of both normals in their planes by Newton, numbers alone."""
    t, o = jnp.zeros_like(k.nm), jnp.zeros_like(k.nm)
    for _ in range(_ROUNDS):
        t, o = _round(k, r, q, t, o)
    return _cosine_and_sine(t), _cosine_and_sine(o)


@jax.jit
def _round(k, r, q, t, o):
    """Tangents of half of both angles after a round of Newton: in them, and with the denominators taken out, the
    conditions are polynomials, which compile to a kernel for each."""
    w, c, s = 1.0 + t * t, 1.0 - t * t, 2.0 * t
    v, d, e = 1.0 + o * o, 1.0 - o * o, 2.0 * o
    to_m, to_v = c * k.nm + s * k.um, c * k.nv + s * k.uv
    both = d * to_m + e * to_v
    first, second = c * k.pn + s * k.pu - r * w, d * k.pm + e * k.pv + q * v
    wrong = v * first + q * both, w * second - r * both
    # the derivatives of w, c, s are s, -s, 2
    by_t = d * (2.0 * k.um - s * k.nm) + e * (2.0 * k.uv - s * k.nv)
    by_o = 2.0 * to_v - e * to_m
    aa, ab = v * (2.0 * k.pu - s * (k.pn + r)) + q * by_t, e * first + q * by_o
    ba, bb = s * second - r * by_t, w * (2.0 * k.pv - e * (k.pm - q)) - r * by_o
    one, other = _turns(aa, ab, ba, bb, wrong)
    return t + one, o + other


def _cosine_and_sine(t):
    """Of an angle, from the tangent of its half."""
    scale = 1.0 / (1.0 + t * t)
    return (1.0 - t * t) * scale, 2.0 * t * scale


@_between_circles.defjvp
def _between_circles_rate(primals, tangents):
    """By the conditions that the span is at right angles to both normals, so that derivatives of every order hold."""
    (k,), (d,) = primals, tangents
    n, m = _between_circles(k)
    u, v, span = cross(k.a, n), cross(k.b, m), k.span + m * k.q - n * k.r
    tilt, lean = k.a * -dot(n, d.a), k.b * -dot(m, d.b)  # normals stay at right angles to their axes
    change = d.span + m * d.q + lean * k.q - n * d.r - tilt * k.r
    wrong = dot(tilt, span) + dot(n, change), dot(lean, span) + dot(m, change)
    along = (jnp.where(dot(axis, axis) > 0, dot(*pair), 1.0) for axis, pair in ((k.a, (u, span)), (k.b, (v, span))))
    aa, bb = along
    one, other = _turns(aa, k.q * dot(n, v), -k.r * dot(m, u), bb, wrong)
    return (n, m), (tilt + u * one, lean + v * other)


def _turns(aa, ab, ba, bb, wrong):
    """Small turns of both normals that take away the projections of the span on them: a system of two equations."""
    det = aa * bb - ab * ba
    det = jnp.where(det == 0, 1.0, det)
    return (ab * wrong[1] - bb * wrong[0]) / det, (ba * wrong[0] - aa * wrong[1]) / det
