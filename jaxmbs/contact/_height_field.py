"""Heights over a plane: roads and terrains."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..checks import faults_if, not_increasing
from ..forces._fields import number, value_faults
from ..math._interpolation import interval, spline_slopes
from ..tables import fields_repr
from ..typing import ArrayLike, ScalarLike


class HeightField(eqx.Module):
    """Height z over x, or over x and y: cubic splines through values on a grid, twice differentiable.

    Beyond the grid the surface goes on straight.  The slopes are worked out at construction and follow traced
    heights.

    Attributes:
        x: (n,) increasing [m].
        heights: (n,), the same for every y, or (n, m) [m].
        y: (m,) increasing [m]; None where the heights are the same for every y.
        slopes: derivatives by x at the points, like the heights; of (n, m) also those by y and by both, (3, n, m).
    """

    x: Float[Array, " n"]
    heights: Float[Array, "n ..."]
    y: Float[Array, " m"] | None
    slopes: Float[Array, "..."]

    __repr__ = fields_repr

    def __init__(self, x: ArrayLike, heights: ArrayLike, y: ArrayLike | None = None) -> None:
        self.x, self.heights, self.y = number(x), number(heights), None if y is None else number(y)
        wanted = self.x.shape + (() if self.y is None else self.y.shape)
        if self.x.ndim != 1 or self.heights.shape != wanted or min(wanted) < 2 or len(wanted) > 2:
            raise ValueError(f"heights must be (len(x),), or (len(x), len(y)) with y: {self.heights.shape}, {wanted}")
        along = spline_slopes(self.x, self.heights)
        if self.y is None:
            self.slopes = along
        else:
            across = spline_slopes(self.y, self.heights.T).T
            self.slopes = jnp.stack([along, across, spline_slopes(self.x, across)])

    def __call__(self, x: ScalarLike, y: ScalarLike) -> Float[Array, ""]:
        """Height () at a place [m]."""
        return self.derivatives(jnp.stack([number(x), number(y)]))[0]

    def derivatives(self, place: Float[Array, " 2"]) -> tuple[Array, Array, Array]:
        """Height (), its slopes (2,) and second derivatives (2, 2) [1/m] at a place (2,)."""
        i, along = _basis(self.x, place[0])
        if self.y is None:
            corners = jnp.concatenate([_two(self.heights, i), _two(self.slopes, i)])
            height, slope, second = along @ corners
            none = jnp.zeros_like(slope)
            return height, jnp.stack([slope, none]), jnp.stack([jnp.stack([second, none]), jnp.stack([none, none])])
        j, across = _basis(self.y, place[1])
        patches = [lax.dynamic_slice(table, (i, j), (2, 2)) for table in (self.heights, *self.slopes)]
        values, by_x, by_y, by_both = patches
        found = along @ jnp.block([[values, by_y], [by_x, by_both]]) @ across.T
        second = jnp.stack([jnp.stack([found[2, 0], found[1, 1]]), jnp.stack([found[1, 1], found[0, 2]])])
        return found[0, 0], jnp.stack([found[1, 0], found[0, 1]]), second

    def sharpest_hollow(self) -> float:
        """Largest curvature [1/m] of the sections along x and y at the points, of concrete heights."""
        heights, slopes = np.asarray(self.heights, float), np.asarray(self.slopes, float)
        if self.y is None:
            return _curvature(np.asarray(self.x, float), heights[:, None], slopes[:, None])
        along = _curvature(np.asarray(self.x, float), heights, slopes[0])
        return max(along, _curvature(np.asarray(self.y, float), heights.T, slopes[1].T))

    def faults(self) -> list[str]:
        """Places increase, and each has a height and slopes."""
        places = self.x.shape + (() if self.y is None else self.y.shape)
        slopes = places if self.y is None else (3, *places)
        if self.heights.shape != places or self.slopes.shape != slopes or min(places) < 2:
            return [f"heights {self.heights.shape} and slopes {self.slopes.shape} do not go with places {places}"]
        return value_faults(self) + faults_if(
            (not_increasing(self.x), "x must increase strictly"),
            (self.y is not None and not_increasing(self.y), "y must increase strictly"),
        )


def _basis(points, x):
    """Interval i; values, first and second derivatives (3, 4) of the Hermite functions there, of the heights at its
    two ends, then of the slopes.  Beyond the points they go on straight."""
    inside = jnp.where(x > points[-1], points[-1], jnp.where(x < points[0], points[0], x))
    beyond, i = x - inside, interval(points, inside)
    start, end = _two(points, i)
    w = end - start
    u = (inside - start) / w
    values = jnp.stack([1 - u * u * (3 - 2 * u), u * u * (3 - 2 * u), w * u * (1 - u) ** 2, w * u * u * (u - 1)])
    first = jnp.stack([6 * u * (u - 1) / w, 6 * u * (1 - u) / w, 1 - u * (4 - 3 * u), u * (3 * u - 2)])
    second = jnp.stack([(12 * u - 6) / w**2, (6 - 12 * u) / w**2, (6 * u - 4) / w, (6 * u - 2) / w])
    second = jnp.where(beyond == 0, second, 0.0)
    return i, jnp.stack([values + beyond * first, first, second])


def _two(rows, i):
    """Rows i and i + 1."""
    return lax.dynamic_slice_in_dim(rows, i, 2, allow_negative_indices=False)


def _curvature(points, values, slopes):
    """Largest curvature of Hermite curves (n, k) at their points."""
    h = np.diff(points)[:, None]
    secant = np.diff(values, axis=0) / h
    starts, ends = 6 * secant - 4 * slopes[:-1] - 2 * slopes[1:], -6 * secant + 2 * slopes[:-1] + 4 * slopes[1:]
    first = starts / h / (1 + slopes[:-1] ** 2) ** 1.5
    return float(max(first.max(), (ends / h / (1 + slopes[1:] ** 2) ** 1.5).max()))
