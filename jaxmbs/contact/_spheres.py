"""Spheres on planes, on spheres and in tubes."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..checks import any_concrete, faults_if, not_positive
from ..drawings import Ball, Drawing, Plane, Tube
from ..forces._fields import number
from ..forces._validity import Margin
from ..math._linalg import direction, safe_norm
from ..typing import Convertible, Matrix3, Scalar, Vector3
from ._pair import AbstractPair, Touch, round_touch


class SphereOnPlane(AbstractPair):
    """A sphere about the origin of B on the plane z = 0 of A, which is solid below; radius 0 is a point.

    Attributes:
        radius: >= 0 [m].
    """

    radius: Convertible[Scalar] = eqx.field(converter=number)

    def touch(self, rotation: Matrix3, displacement: Vector3) -> Touch:
        normal = jnp.asarray(np.array((0.0, 0.0, 1.0)), displacement.dtype)
        return round_touch(displacement, normal, self.radius - displacement[2], self.radius)

    def drawing(self) -> Drawing:
        return Plane(0), Ball(self.radius, 1)

    def area(self, depth: Array) -> Array:
        """The circle of Hertz, `pi r d`."""
        return np.pi * self.radius * depth

    def faults(self) -> list[str]:
        return super().faults() + faults_if(
            (any_concrete(lambda r: r < 0, self.radius), "radius must not be negative")
        )


class SphereOnSphere(AbstractPair):
    """A sphere about the origin of B on one about the origin of A.  Centres must not coincide.

    Attributes:
        radius: of the sphere on B, > 0 [m].
        other_radius: of the sphere on A, > 0 [m].
    """

    radius: Convertible[Scalar] = eqx.field(converter=number)
    other_radius: Convertible[Scalar] = eqx.field(converter=number)

    def touch(self, rotation: Matrix3, displacement: Vector3) -> Touch:
        depth = self.radius + self.other_radius - safe_norm(displacement)
        return round_touch(displacement, direction(displacement), depth, self.radius)

    def validity(self, rotation: Matrix3, displacement: Vector3) -> dict[str, Margin]:
        """Distance of the centres, less a thousandth of both radii [m]."""
        apart = safe_norm(displacement) - 1e-3 * (self.radius + self.other_radius)
        return {"centres": Margin(apart, "m", "has both centres at one place, which gives no direction")}

    def drawing(self) -> Drawing:
        return Ball(self.other_radius, 0, is_clear=True), Ball(self.radius, 1)

    def area(self, depth: Array) -> Array:
        """The circle of Hertz, `pi r d` of the radius r of both: `1/r = 1/r1 + 1/r2`."""
        return np.pi * self.radius * self.other_radius / (self.radius + self.other_radius) * depth

    def faults(self) -> list[str]:
        return super().faults() + faults_if(
            (not_positive(self.radius), "radius must be positive"),
            (not_positive(self.other_radius), "other_radius must be positive"),
        )


class SphereInCylinder(AbstractPair):
    """A sphere about the origin of B in a tube along the axis z of A, as a pin in a slot or a ball in a sleeve.

    The tube has no ends.  The gap all around is `clearance`; the force has its direction from the axis, so that the
    sphere may pass through the centre.

    Attributes:
        radius: of the sphere, > 0 [m].
        clearance: radius of the tube less that of the sphere, > 0 [m].
    """

    radius: Convertible[Scalar] = eqx.field(converter=number)
    clearance: Convertible[Scalar] = eqx.field(converter=number)

    def touch(self, rotation: Matrix3, displacement: Vector3) -> Touch:
        across = displacement * np.array((1.0, 1.0, 0.0), displacement.dtype)
        depth = safe_norm(across) - self.clearance
        return round_touch(displacement, -direction(across), depth, self.radius)

    def drawing(self) -> Drawing:
        return Tube(self.radius + self.clearance, None, 0), Ball(self.radius, 1)

    def area(self, depth: Array) -> Array:
        """A square of the chord, `8 r d`: the sphere nearly fills the tube."""
        return 8.0 * self.radius * depth

    def faults(self) -> list[str]:
        return super().faults() + faults_if(
            (not_positive(self.radius), "radius must be positive"),
            (not_positive(self.clearance), "clearance must be positive"),
        )
