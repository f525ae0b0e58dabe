"""Planar joint: sliding in a plane and turning about its normal."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..math._rotation import axis_basis
from ..typing import Convertible, Matrix3
from ._base import AbstractJoint, Node, axis_direction, axis_faults, parallel_rows


class Planar(AbstractJoint):
    """Motion in the plane across `normal` ("x", "-y" or three numbers, in joint axes).

    Coordinates: x, then y [m] of the child's origin, positive along two axes fixed in the parent's plane, then angle
    [rad], right-handed about the normal; zero where the frames agree.  For the normal "z" the two axes are x, y, for
    "x" they are y, z, for "y" they are z, x; x, y and the normal are right-handed.  Velocities: their rates
    [m/s, m/s, rad/s].  Efforts: two forces [N], then a moment [N m].
    """

    nodes = (Node("prismatic", "x"), Node("prismatic", "y"), Node("revolute"))
    labels = ("x", "y", "angle")
    row_units = ("m", "rad", "rad")
    symbol = "plane"

    normal: Convertible[Float[Array, "3"]] = eqx.field(converter=axis_direction, default="z")

    def basis(self) -> Matrix3:
        return axis_basis(self.normal)

    def closure(self, R: Array, d: Array) -> Array:
        return jnp.concatenate([d[2:], parallel_rows(R)])

    def faults(self) -> list[str]:
        return axis_faults(self.normal)
