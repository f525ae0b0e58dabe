"""Heights over a plane: roads and terrains."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import faults_if, not_increasing
from ..forces._fields import number, value_faults
from ..math._interpolation import hermite, spline_slopes
from ..typing import ArrayLike, ScalarLike


class HeightField(eqx.Module):
    """Height z over x, or over x and y: cubic splines through values on a grid, twice differentiable.

    Beyond the grid the surface goes on straight.  The slopes are worked out at construction and follow traced heights.

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
        if self.y is None:
            return hermite(self.x, self.heights, self.slopes, x)
        along, across, twist = self.slopes
        row, row_slopes = hermite(self.x, self.heights, along, x), hermite(self.x, across, twist, x)
        return hermite(self.y, row, row_slopes, y)

    def sharpest_hollow(self) -> float:
        """Largest curvature [1/m] of the sections along x and y at the points, of concrete heights."""
        heights, slopes = np.asarray(self.heights, float), np.asarray(self.slopes, float)
        if self.y is None:
            return _curvature(np.asarray(self.x, float), heights[:, None], slopes[:, None])
        along = _curvature(np.asarray(self.x, float), heights, slopes[0])
        return max(along, _curvature(np.asarray(self.y, float), heights.T, slopes[1].T))

    def faults(self) -> list[str]:
        """Places increase."""
        return value_faults(self) + faults_if(
            (not_increasing(self.x), "x must increase strictly"),
            (self.y is not None and not_increasing(self.y), "y must increase strictly"),
        )


def _curvature(points, values, slopes):
    """Largest curvature of Hermite curves (n, k) at their points."""
    h = np.diff(points)[:, None]
    secant = np.diff(values, axis=0) / h
    starts, ends = 6 * secant - 4 * slopes[:-1] - 2 * slopes[1:], -6 * secant + 2 * slopes[:-1] + 4 * slopes[1:]
    first = starts / h / (1 + slopes[:-1] ** 2) ** 1.5
    return float(max(first.max(), (ends / h / (1 + slopes[1:] ** 2) ** 1.5).max()))
