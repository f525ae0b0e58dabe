"""Screw joint: turning about an axis advances along it."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import is_concrete
from ..math._rotation import axis_basis
from ..runtime import as_array
from ..typing import Convertible, Matrix3, Scalar
from ._base import AbstractJoint, Node, axis_direction, axis_faults, half_angle_tangents, parallel_rows


class Screw(AbstractJoint):
    """Rotation about `axis` with an advance of `pitch` [m/rad] along it; a lead of 5 mm a turn is 5e-3 / (2 pi).

    Coordinate: angle [rad] of the child in the parent, right-handed about the axis, zero where the frames agree; with
    a positive pitch a positive angle moves the child along +axis.  Velocity: its rate [rad/s].  Effort: moment [N m].
    Closing a loop it counts whole turns by the nearest one, so the loop's other joints carry the number of turns.
    """

    nodes = (Node("screw"),)
    labels = ("angle",)
    row_units = ("m", "m", "m", "rad", "rad")
    is_reversible = True
    symbol = "screw"

    axis: Convertible[Float[Array, "3"]] = eqx.field(converter=axis_direction, default="z")
    pitch: Convertible[Float[Array, ""]] = eqx.field(converter=as_array, default=0.0, kw_only=True)

    def basis(self) -> Matrix3:
        return axis_basis(self.axis)

    def lead(self) -> Scalar:
        return self.pitch

    def closure(self, R: Array, d: Array) -> Array:
        angle = d[2] / self.pitch
        sine = R[0, 0] * jnp.sin(angle) - R[1, 0] * jnp.cos(angle)
        cosine = R[0, 0] * jnp.cos(angle) + R[1, 0] * jnp.sin(angle)
        return jnp.concatenate([d[:2], self.pitch * half_angle_tangents(sine[None], cosine), parallel_rows(R)])

    def faults(self) -> list[str]:
        flat = is_concrete(self.pitch) and not (np.isfinite(self.pitch) and abs(self.pitch) > 0)
        return axis_faults(self.axis) + (["its pitch is zero or not finite; use a Revolute"] if flat else [])
