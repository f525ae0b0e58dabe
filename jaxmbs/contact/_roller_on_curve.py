"""A roller on a closed curve: cams."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..checks import any_concrete, faults_if, not_positive
from ..drawings import Drawing, Outline, Wheel
from ..forces._fields import number
from ..forces._validity import MOST_TILT, Margin
from ..math._linalg import safe_norm
from ..typing import Convertible, Matrix3, Scalar, Vector3, WordedError
from ._closed_curve import ClosedCurve
from ._pair import AbstractPair, Touch, round_touch

_DRAWN = 6  # points of the drawn curve for each of its own


class RollerOnCurve(AbstractPair):
    """A roller about the axis z of B on a closed curve in the plane x y of A, the cam; radius 0 is a knife edge.

    Both axes are parallel.  The roller must fit into every hollow of the cam: it touches in one point only.

    Attributes:
        curve: the outline of the cam in its frame.
        radius: of the roller, >= 0 [m].
        width: of the line of contact, for pressures, > 0 [m].
    """

    curve: WordedError[ClosedCurve]
    radius: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    width: Convertible[Scalar] = eqx.field(converter=number, default=1.0)

    def __check_init__(self):
        if not isinstance(self.curve, ClosedCurve):
            raise TypeError(f"curve must be a ClosedCurve, got {type(self.curve).__name__}")

    def touch(self, rotation: Matrix3, displacement: Vector3) -> Touch:
        distance, normal = self.curve.distance(displacement[:2])
        upright = jnp.concatenate([normal, jnp.zeros_like(normal[:1])])
        return round_touch(displacement, upright, self.radius - distance, self.radius)

    def validity(self, rotation: Matrix3, displacement: Vector3) -> dict[str, Margin]:
        """Angle that is left to axes that are not parallel [rad]."""
        tilt = jnp.arctan2(safe_norm(rotation[:2, 2]), jnp.abs(rotation[2, 2]))
        return {"tilt": Margin(MOST_TILT - tilt, "rad", "has axes that are not parallel")}

    def drawing(self) -> Drawing:
        n = len(self.curve.points)
        points = jax.vmap(lambda s: self.curve.at(s)[0])(np.arange(_DRAWN * n) / _DRAWN)
        return Outline(np.asarray(points), 0), Wheel(self.radius, frame=1)

    def area(self, depth: Array) -> Array:
        """The chord of the roller times the width, `2 b sqrt(2 r d)`."""
        chord = 2.0 * jnp.sqrt(2.0 * self.radius * jnp.where(depth > 0, depth, 1.0))
        return jnp.where(depth > 0, self.width * chord, 0.0)

    def faults(self) -> list[str]:
        """The roller fits into every hollow."""
        found = super().faults() + faults_if(
            (any_concrete(lambda r: r < 0, self.radius), "radius must not be negative"),
            (self.width.shape != (), "width must be one number"),
            (not_positive(self.width), "width must be positive"),
        )
        if found or not any_concrete(lambda k, r: k * r <= -1.0, self.curve.curvatures(), self.radius):
            return found
        hollow = -1.0 / float(jnp.min(self.curve.curvatures()))
        return [f"radius must be less than {hollow:.4g} m, that of the curve's sharpest hollow"]
