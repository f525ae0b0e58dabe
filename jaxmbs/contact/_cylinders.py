"""Cylinders on planes, and journals in their bushes."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..checks import faults_if, not_positive
from ..drawings import Cylinder, Drawing, Plane, Tube
from ..forces._fields import number
from ..forces._validity import Margin
from ..math._extremes import largest
from ..math._linalg import direction, safe_norm
from ..typing import Convertible, Matrix3, Scalar, Vector3
from ._pair import AbstractPair, Touch

#: Angle to the axis of the plane [rad] below which a cylinder stands on its end.
_STANDING = 0.01
#: Least cosine of the tilt of a journal that is divided by: far beyond its end.
_LEVEL = 1e-3


class CylinderOnPlane(AbstractPair):
    """A cylinder about the axis z of B, in the middle of its length, on the plane z = 0 of A, solid below.

    It touches by the lowest points of its two rims, half of the stiffness each, so that it tilts.  It must not stand
    on an end: there the lowest point of a rim is not determined.

    Attributes:
        radius: > 0 [m].
        length: > 0 [m].
    """

    radius: Convertible[Scalar] = eqx.field(converter=number)
    length: Convertible[Scalar] = eqx.field(converter=number)

    def touch(self, rotation: Matrix3, displacement: Vector3) -> Touch:
        axis, up = rotation[:, 2], np.array((0.0, 0.0, 1.0), displacement.dtype)
        in_rim = up - axis * axis[2]
        ends = np.array((-0.5, 0.5), displacement.dtype)
        centres = displacement[None] + ends[:, None] * (self.length * axis)[None]
        depth = self.radius * safe_norm(in_rim) - centres[:, 2]
        lowest = centres - self.radius * direction(in_rim)[None]
        half = jnp.full(2, 0.5, displacement.dtype)
        return Touch(depth, jnp.stack([up, up]), lowest + depth[:, None] / 2 * up[None], half)

    def validity(self, rotation: Matrix3, displacement: Vector3) -> dict[str, Margin]:
        """Angle of the axis to that of the plane, less a hundredth [rad]; apart also the gap over the length."""
        tilt = jnp.arctan2(safe_norm(rotation[:2, 2]), jnp.abs(rotation[2, 2])) - _STANDING
        gap = -largest(self.touch(rotation, displacement).depth)
        left = jnp.where(gap > 0, jnp.maximum(tilt, gap / self.length), tilt)
        return {"tilt": Margin(left, "rad", "has an end on the plane, no point of whose rim is lowest")}

    def drawing(self) -> Drawing:
        return Plane(0), Cylinder(self.radius, self.length, 1)

    def area(self, depth: Array) -> Array:
        """Half of the chord times half of the length, `L sqrt(2 r d) / 2`, at each rim."""
        half = jnp.sqrt(2.0 * self.radius * jnp.where(depth > 0, depth, 1.0)) / 2
        return jnp.where(depth > 0, self.length * half, 0.0)

    def faults(self) -> list[str]:
        return super().faults() + faults_if(
            (not_positive(self.radius), "radius must be positive"),
            (not_positive(self.length), "length must be positive"),
        )


class JournalInBush(AbstractPair):
    """A journal about the axis z of B, in the middle of its length, in a bush along the axis z of A, with clearance.

    The depth is followed at `sections` Gauss points along the journal, so that a tilted journal bears at its edges
    and a moment rights it.  The stiffness is that of the whole length.  The bush is as long as the journal and does
    not hold it axially.

    Attributes:
        radius: of the journal, > 0 [m].
        clearance: radius of the bush less that of the journal, > 0 [m].
        length: > 0 [m].
        sections: number of points along the length, >= 1 (static); 1 leaves the tilt free.
    """

    radius: Convertible[Scalar] = eqx.field(converter=number)
    clearance: Convertible[Scalar] = eqx.field(converter=number)
    length: Convertible[Scalar] = eqx.field(converter=number)
    sections: int = eqx.field(static=True, default=4)

    def touch(self, rotation: Matrix3, displacement: Vector3) -> Touch:
        places, shares = self._sections()
        places = jnp.asarray(places, displacement.dtype)
        centres = displacement[None] + places[:, None] * (self.length * rotation[:, 2])[None]
        across = centres * np.array([(1.0, 1.0, 0.0)], displacement.dtype)
        outwards = jax.vmap(direction)(across)
        depth = jax.vmap(safe_norm)(across) - self.clearance
        point = centres + (self.radius - depth / 2)[:, None] * outwards
        return Touch(depth, -outwards, point, jnp.asarray(shares, displacement.dtype))

    def validity(self, rotation: Matrix3, displacement: Vector3) -> dict[str, Margin]:
        """Length that is still in the bush [m]; half of the clearance, less what the elliptic sections of a tilted
        journal take of it [m]."""
        longer = self.radius * (1.0 / jnp.maximum(jnp.abs(rotation[2, 2]), _LEVEL) - 1.0)
        return {
            "reach": Margin(self.length - jnp.abs(displacement[2]), "m", "has left its bush along the axis"),
            "tilt": Margin(self.clearance / 2 - longer, "m", "tilts so much that its sections are no circles"),
        }

    def drawing(self) -> Drawing:
        return Tube(self.radius + self.clearance, self.length, 0), Cylinder(self.radius, self.length, 1)

    def area(self, depth: Array) -> Array:
        """The projected area of each section, `2 r L` times its share."""
        return 2.0 * self.radius * self.length * jnp.asarray(self._sections()[1], depth.dtype)

    def faults(self) -> list[str]:
        if not isinstance(self.sections, int) or self.sections < 1:
            return [f"sections must be a whole number from 1 on, got {self.sections!r}"]
        return super().faults() + faults_if(
            (not_positive(self.radius), "radius must be positive"),
            (not_positive(self.clearance), "clearance must be positive"),
            (not_positive(self.length), "length must be positive"),
        )

    def _sections(self):
        """Places along the length, from -1/2 to 1/2, and shares that add up to one."""
        nodes, weights = np.polynomial.legendre.leggauss(self.sections)
        return nodes / 2, weights / 2
