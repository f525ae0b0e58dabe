"""Closed plane curve through points, a periodic cubic spline."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..checks import any_concrete, faults_if
from ..forces._fields import number, value_faults
from ..math._linalg import direction
from ..tables import fields_repr
from ..typing import ArrayLike, ScalarLike

_ROUNDS = 6  # of Newton's method for the foot, from the nearest of two samples to every point


class ClosedCurve(eqx.Module):
    """Closed curve in the plane x y through points, twice differentiable: a periodic cubic spline.

    Counter-clockwise points enclose the solid, as of a cam; clockwise ones a hole, as of a ring.  Give the points at
    about equal distances; a hundred of them follow an ellipse to about 1e-7 of its size.  The slopes are worked out
    at construction and follow traced points; to change a built curve make a new one.

    Attributes:
        points: (n, 2) in turn, the first not repeated, n >= 8 [m].
        slopes: (n, 2) derivatives by the number of the point [m].
    """

    points: Float[Array, "n 2"]
    slopes: Float[Array, "n 2"]

    __repr__ = fields_repr

    def __init__(self, points: ArrayLike) -> None:
        self.points = number(points)
        if self.points.ndim != 2 or self.points.shape[1] != 2 or len(self.points) < 8:
            raise ValueError(f"a closed curve needs 8 or more points (n, 2), got shape {self.points.shape}")
        n = len(self.points)
        column = np.fft.ifft(1.0 / (4.0 + 2.0 * np.cos(2.0 * np.pi * np.arange(n) / n))).real
        inverse = column[(np.arange(n)[:, None] - np.arange(n)[None, :]) % n]
        chords = jnp.roll(self.points, -1, axis=0) - jnp.roll(self.points, 1, axis=0)
        self.slopes = jnp.asarray(3.0 * inverse, self.points.dtype) @ chords

    def at(self, s: ScalarLike) -> tuple[Array, Array, Array]:
        """Point, first and second derivative (2,) at a parameter s (): a point's number, and part of the way on."""
        k = jnp.floor(s)
        u = s - k
        first = k.astype(int) % len(self.points)
        both = jnp.stack([first, (first + 1) % len(self.points)])
        (p, q), (b, e) = self.points[both], self.slopes[both]
        square, cube = 3.0 * (q - p) - 2.0 * b - e, 2.0 * (p - q) + b + e
        point = p + u * (b + u * (square + u * cube))
        return point, b + u * (2.0 * square + u * 3.0 * cube), 2.0 * square + 6.0 * u * cube

    def distance(self, place: Float[Array, " 2"]) -> tuple[Float[Array, ""], Float[Array, " 2"]]:
        """Distance () of a place (2,) from the curve [m], negative in the solid, and the normal (2,) out of it."""
        point, tangent, _ = self.at(self._foot(place))
        normal = direction(tangent)[::-1] * np.array((1.0, -1.0), place.dtype)
        return jnp.dot(place - point, normal), normal

    def curvatures(self) -> Float[Array, " k"]:
        """Curvatures (k,), k = 2 n, at the points and half way between [1/m], positive where the solid is convex."""
        _, first, second = self._samples()
        return (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / jnp.sum(first**2, axis=1) ** 1.5

    def faults(self) -> list[str]:
        """Finite points with a slope each, none of them twice."""
        if self.points.shape != self.slopes.shape or self.points.shape[1:] != (2,) or len(self.points) < 8:
            return [f"points {self.points.shape} and slopes {self.slopes.shape} do not go together"]
        same = any_concrete(lambda p: np.all(p == np.roll(p, 1, axis=0), axis=1), self.points)
        return value_faults(self) + faults_if((same, "points: two neighbours coincide; do not repeat the first one"))

    def _samples(self):
        """Points and derivatives at the points and half way between."""
        p, b = self.points, self.slopes
        q, e = jnp.roll(p, -1, axis=0), jnp.roll(b, -1, axis=0)
        square, cube = 3.0 * (q - p) - 2.0 * b - e, 2.0 * (p - q) + b + e
        half = p + 0.5 * (b + 0.5 * (square + 0.5 * cube)), b + square + 0.75 * cube, 2.0 * square + 3.0 * cube
        both = zip((p, b, 2.0 * square), half, strict=True)
        return tuple(jnp.stack(pair, axis=1).reshape(-1, 2) for pair in both)

    def _foot(self, place):
        """Parameter of the nearest point.  The search has no derivative; two last steps of Newton's method give that
        of the first and second order."""
        fixed, target = lax.stop_gradient((self, place))
        nearest = jnp.argmin(jnp.sum((fixed._samples()[0] - target[None]) ** 2, axis=1))
        s = lax.fori_loop(0, _ROUNDS, lambda _, s: fixed._step(s, target), 0.5 * nearest.astype(target.dtype))
        return self._step(self._step(lax.stop_gradient(s), place), place)

    def _step(self, s, place):
        """A step of Newton's method for the foot; its slope is kept away from zero where curve and place are such
        that no foot is the nearest."""
        point, first, second = self.at(s)
        square = jnp.dot(first, first)
        slope = jnp.dot(place - point, second) - square
        return s - jnp.clip(jnp.dot(place - point, first) / jnp.minimum(slope, -0.05 * square), -1.0, 1.0)
