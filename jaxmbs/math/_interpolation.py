"""Piecewise cubic interpolation of tabulated curves: monotone (PCHIP) and spline, with linear continuation.

A curve is `(points (n,), values (n, ...), slopes (n, ...))`, n >= 2, points strictly increasing. Beyond the
first and last point it continues along the end slope, so it is C1 everywhere. Everything is differentiable in
x and the data.
"""

import math

import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float, Int

from ..runtime import jit

#: Above so many points, n, intervals are looked up in two rounds: every sqrt(n)-th point, then those between.
_ONE_ROUND = 64


def interval(points: Float[Array, " n"], x: Float[Array, ""]) -> Int[Array, ""]:
    """Index i of the interval `points[i] <= x < points[i+1]`, clipped to the first and last one.

    By counting, which a batch does side by side: of n points twice their square root.
    """
    n, first = points.shape[0], 0
    if n > _ONE_ROUND:
        points = lax.stop_gradient(points)
        stride = math.isqrt(n)
        first = stride * jnp.maximum(jnp.sum(points[::stride] <= x) - 1, 0)
        first = jnp.minimum(first, n - stride)
        points = lax.dynamic_slice_in_dim(points, first, stride, allow_negative_indices=False)
    return jnp.clip(first + jnp.sum(points <= x) - 1, 0, n - 2)


def hermite(points, values, slopes, x) -> Float[Array, "..."]:
    """Value at x (scalar) of the cubic Hermite curve.

    Args:
        points: (n,) abscissae.
        values: (n,) or (n, k) ordinates.
        slopes: like `values`, derivatives at the points.
        x: scalar abscissa.
    Returns:
        scalar or (k,).
    """
    inside, beyond, i, last = _locate(points, x)
    width, s = _local(points, inside, i)
    start, (linear, square, cube) = _local_slopes(width, values, slopes, i)
    cubic = start + width * s * (linear + s * (square + s * cube))
    return cubic + beyond * jnp.where(last, slopes[-1], slopes[0])


def hermite_integral(points, values, slopes, x) -> Float[Array, ""]:
    """Integral of the scalar curve `hermite` from the first point to x, exact also in the continuation."""
    inside, beyond, i, last = _locate(points, x)
    width, s = _local(points, inside, i)
    start, (linear, square, cube) = _local_slopes(width, values, slopes, i)
    local = width * (s * start + width * (s**2 * linear / 2 + s**3 * square / 3 + s**4 * cube / 4))
    h = jnp.diff(points)
    areas = h * (values[1:] + values[:-1]) / 2 + h**2 * (slopes[:-1] - slopes[1:]) / 12
    before = jnp.sum(jnp.where(jnp.arange(h.shape[0]) < i, areas, 0.0))
    end_value = jnp.where(last, values[-1], values[0])
    return before + local + beyond * end_value + beyond**2 * jnp.where(last, slopes[-1], slopes[0]) / 2


@jit
def pchip_slopes(points: Float[Array, " n"], values: Float[Array, " n"]) -> Float[Array, " n"]:
    """Slopes of the monotone cubic interpolant of Fritsch and Butland (as SciPy's PchipInterpolator)."""
    h = jnp.diff(points)
    secant = jnp.diff(values) / h
    if points.shape[0] == 2:
        return jnp.concatenate([secant, secant])
    w_left, w_right = 2 * h[1:] + h[:-1], h[1:] + 2 * h[:-1]
    left, right = secant[:-1], secant[1:]
    same_sign = left * right > 0
    denominator = jnp.where(same_sign, w_left * right + w_right * left, 1.0)
    inner = jnp.where(same_sign, left * right * (w_left + w_right) / denominator, 0.0)
    first = _end_slope(h[0], h[1], secant[0], secant[1])
    final = _end_slope(h[-1], h[-2], secant[-1], secant[-2])
    return jnp.concatenate([first[None], inner, final[None]])


@jit
def spline_slopes(points: Float[Array, " n"], values, end_slopes=None):
    """Slopes that make the Hermite curve a cubic spline (C2).

    Args:
        points: (n,) abscissae.
        values: (n,) or (n, k) ordinates.
        end_slopes: None for the natural spline (no curvature at the ends), else the first and last slope.
    Returns:
        like `values`.
    """
    n = points.shape[0]
    rows = values.reshape(n, -1)
    inverse = 1 / jnp.diff(points)
    pull = 3 * jnp.diff(rows, axis=0) * inverse[:, None] ** 2
    one, zero = jnp.ones(1, inverse.dtype), jnp.zeros(1, inverse.dtype)
    if end_slopes is None:
        end, end_neighbour = 2 * one, one
        head, tail = pull[0] / inverse[0], pull[-1] / inverse[-1]
    else:
        end, end_neighbour = one, zero
        head, tail = (jnp.broadcast_to(slope, rows.shape[1:]) for slope in end_slopes)
    lower = jnp.concatenate([zero, inverse[:-1], end_neighbour])
    upper = jnp.concatenate([end_neighbour, inverse[1:], zero])
    diagonal = jnp.concatenate([end, 2 * (inverse[:-1] + inverse[1:]), end])
    right_side = jnp.concatenate([head[None], pull[:-1] + pull[1:], tail[None]])
    return _tridiagonal_solve(lower, diagonal, upper, right_side).reshape(values.shape)


def _tridiagonal_solve(lower, diagonal, upper, right):
    """Solution (n, k) by elimination without pivots, the diagonal (n,) being the larger part of each row."""

    def down(above, row):
        share, y = above
        a, d, c, b = row
        pivot = d - a * share
        here = c / pivot, (b - a * y) / pivot
        return here, here

    def up(below, row):
        share, y = row
        x = y - share * below
        return x, x

    rest = jnp.zeros_like(right[0])
    _, rows = jax.lax.scan(down, (jnp.zeros_like(lower[0]), rest), (lower, diagonal, upper, right))
    return jax.lax.scan(up, rest, rows, reverse=True)[1]


def _locate(points, x):
    """x held inside the table, its excess beyond it, its interval, and whether it is past the last point.

    Plain selections, not `clip`: at an end point itself the derivatives are those of the curve inside.
    """
    first, end = points[0], points[-1]
    last = x > end
    inside = jnp.where(last, end, jnp.where(x < first, first, x))
    return inside, x - inside, interval(points, inside), last


def _local(points, inside, i):
    left, right = _both_ends(points, i)
    width = right - left
    return width, (inside - left) / width


def _local_slopes(width, values, slopes, i):
    """The value at the interval's start, and the coefficients of its powers."""
    (start, end), (first, second) = _both_ends(values, i), _both_ends(slopes, i)
    secant = (end - start) / width
    bend = first - secant
    cube = bend + second - secant
    return start, (first, -bend - cube, cube)


def _both_ends(rows, i):
    """Rows i and i + 1."""
    return lax.dynamic_slice_in_dim(rows, i, 2, allow_negative_indices=False)


def _end_slope(h0, h1, secant0, secant1):
    """Three-point end slope, limited so that the curve stays monotone."""
    slope = ((2 * h0 + h1) * secant0 - h0 * secant1) / (h0 + h1)
    slope = jnp.where(slope * secant0 <= 0, 0.0, slope)
    limit = (secant0 * secant1 <= 0) & (jnp.abs(slope) > 3 * jnp.abs(secant0))
    return jnp.where(limit, 3 * secant0, slope)
