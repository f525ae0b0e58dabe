"""Prismatic joint: one sliding distance along an axis common to both frames."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..math._rotation import axis_basis
from ..typing import Convertible, Matrix3
from ._base import AbstractJoint, Node, alignment_rows, axis_direction, axis_faults


class Prismatic(AbstractJoint):
    """Translation along `axis` ("x", "-y" or three numbers, in joint axes).

    Coordinate: distance [m] of the child from the parent, positive along the axis, zero where the frames agree.
    Velocity: its rate [m/s].  Effort: force along the axis [N].

    Source: S2 (11)-(15), a simple joint with alpha = 0.
    """

    nodes = (Node("prismatic"),)
    labels = ("distance",)
    row_units = ("m", "m", "rad", "rad", "rad")
    is_reversible = True
    symbol = "slide"

    axis: Convertible[Float[Array, "3"]] = eqx.field(converter=axis_direction, default="z")

    def basis(self) -> Matrix3:
        return axis_basis(self.axis)

    def closure(self, R: Array, d: Array) -> Array:
        return jnp.concatenate([d[:2], alignment_rows(R)])

    def faults(self) -> list[str]:
        return axis_faults(self.axis)
