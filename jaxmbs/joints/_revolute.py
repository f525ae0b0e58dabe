"""Revolute joint: one angle about an axis common to both frames."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..math._rotation import axis_basis
from ..typing import Convertible, Matrix3
from ._base import AbstractJoint, Node, axis_direction, axis_faults, parallel_rows


class Revolute(AbstractJoint):
    """Rotation about `axis` ("x", "-y" or three numbers, in joint axes).

    Coordinate: angle [rad] of the child in the parent, right-handed about the axis, zero where the frames agree.
    Velocity: its rate [rad/s].  Effort: moment about the axis [N m].

    Source: S2 (11)-(15), a simple joint with alpha = 1.
    """

    nodes = (Node("revolute"),)
    labels = ("angle",)
    row_units = ("m", "m", "m", "rad", "rad")
    is_reversible = True
    symbol = "pin"

    axis: Convertible[Float[Array, "3"]] = eqx.field(converter=axis_direction, default="z")

    def basis(self) -> Matrix3:
        return axis_basis(self.axis)

    def closure(self, R: Array, d: Array) -> Array:
        return jnp.concatenate([d, parallel_rows(R)])

    def faults(self) -> list[str]:
        return axis_faults(self.axis)
