"""Cylindrical joint: sliding along and turning about one axis."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..math._rotation import axis_basis
from ..typing import Convertible, Matrix3
from ._base import AbstractJoint, Node, axis_direction, axis_faults, parallel_rows


class Cylindrical(AbstractJoint):
    """Translation along and rotation about `axis` ("x", "-y" or three numbers, in joint axes).

    Coordinates: distance [m], positive along the axis, then angle [rad], right-handed about it; zero where the
    frames agree.  Velocities: their rates [m/s, rad/s].  Efforts: force [N], then moment [N m].
    """

    nodes = (Node("prismatic"), Node("revolute"))
    labels = ("distance", "angle")
    row_units = ("m", "m", "rad", "rad")
    is_reversible = True
    symbol = "sleeve"

    axis: Convertible[Float[Array, "3"]] = eqx.field(converter=axis_direction, default="z")

    def basis(self) -> Matrix3:
        return axis_basis(self.axis)

    def closure(self, R: Array, d: Array) -> Array:
        return jnp.concatenate([d[:2], parallel_rows(R)])

    def faults(self) -> list[str]:
        return axis_faults(self.axis)
