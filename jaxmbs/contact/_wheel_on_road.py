"""A wheel or a point on a height field."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..checks import any_concrete, faults_if, is_concrete
from ..drawings import Ball, Drawing, HeightSurface
from ..forces._fields import number
from ..typing import Convertible, Matrix3, Scalar, Vector3, WordedError
from ._height_field import HeightField
from ._pair import AbstractPair, Touch, round_touch

_ROUNDS = 8  # of Newton's method for the foot, from below the centre


class WheelOnRoad(AbstractPair):
    """A wheel, as a sphere about the origin of B, on a height field over the plane x y of A; radius 0 is a point.

    The wheel must fit into every hollow of the road: it touches in one point only.

    Attributes:
        road: heights in the frame A, solid below.
        radius: >= 0 [m].
    """

    road: WordedError[HeightField]
    radius: Convertible[Scalar] = eqx.field(converter=number, default=0.0)

    def __check_init__(self):
        if not isinstance(self.road, HeightField):
            raise TypeError(f"road must be a HeightField, got {type(self.road).__name__}")

    def touch(self, rotation: Matrix3, displacement: Vector3) -> Touch:
        foot = self._foot(displacement)
        height, slope, _ = self.road.derivatives(foot)
        steep = jnp.concatenate([-slope, jnp.ones_like(slope[:1])])
        normal = steep / jnp.sqrt(jnp.sum(steep * steep))
        distance = jnp.dot(displacement - jnp.concatenate([foot, height[None]]), normal)
        return round_touch(displacement, normal, self.radius - distance, self.radius)

    def drawing(self) -> Drawing:
        return HeightSurface(self.road, (self.road.x[0], self.road.x[-1]), 0), Ball(self.radius, 1)

    def area(self, depth: Array) -> Array:
        """The circle of Hertz on a plane, `pi r d`."""
        return np.pi * self.radius * depth

    def faults(self) -> list[str]:
        """The wheel fits into every hollow."""
        found = super().faults() + faults_if(
            (any_concrete(lambda r: r < 0, self.radius), "radius must not be negative")
        )
        if found or not is_concrete(self.road, self.radius):
            return found
        sharpest = self.road.sharpest_hollow()
        return faults_if(
            (
                sharpest * float(self.radius) >= 1.0,
                f"radius must be less than {1 / max(sharpest, 1e-30):.4g} m, that of the road's sharpest hollow",
            )
        )

    def _foot(self, centre):
        """Place (2,) of the nearest point.  The search has no derivative; two last steps of Newton's method give that
        of the first and second order."""
        fixed, target = lax.stop_gradient((self, centre))
        foot = lax.fori_loop(0, _ROUNDS, lambda _, foot: fixed._step(foot, target), target[:2])
        return self._step(self._step(lax.stop_gradient(foot), centre), centre)

    def _step(self, foot, centre):
        """A step of Newton's method on half of the squared distance; without the curvature of the road where that
        leaves no minimum."""
        height, slope, second = self.road.derivatives(foot)
        above = height - centre[2]
        left = foot - centre[:2] + above * slope
        plain = jnp.asarray(np.eye(2), foot.dtype) + jnp.outer(slope, slope)
        full = plain + above * second
        is_minimum = (_determinant(full) > 0.05 * _determinant(plain)) & (full[0, 0] + full[1, 1] > 0)
        H = jnp.where(is_minimum, full, plain)
        solved = jnp.stack([H[1, 1] * left[0] - H[0, 1] * left[1], H[0, 0] * left[1] - H[1, 0] * left[0]])
        return foot - solved / _determinant(H)


def _determinant(H):
    return H[0, 0] * H[1, 1] - H[0, 1] * H[1, 0]
