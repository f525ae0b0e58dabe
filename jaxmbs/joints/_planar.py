"""Planar joint: sliding in a plane and turning about its normal."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import is_concrete
from ..math._rotation import axis_basis
from ..typing import Convertible, Matrix3
from ._base import AbstractJoint, Node, axis_direction, axis_faults, parallel_rows


class Planar(AbstractJoint):
    """Motion in the plane across `normal` ("x", "-y" or three numbers, in joint axes).

    Coordinates: x, then y [m] of the child's origin, positive along two axes fixed in the parent's plane, then angle
    [rad], right-handed about the normal; zero where the frames agree.  For the normal "z" the two axes are x, y, for
    "x" they are y, z, for "y" they are z, x, and tables call them so; both and the normal are right-handed.
    Velocities: their rates [m/s, m/s, rad/s].  Efforts: two forces [N], then a moment [N m].
    """

    nodes = (Node("prismatic", "x"), Node("prismatic", "y"), Node("revolute"))
    labels = ("x", "y", "angle")
    row_units = ("m", "rad", "rad")
    symbol = "plane"

    normal: Convertible[Float[Array, "3"]] = eqx.field(converter=axis_direction, default="z")

    @property
    def own_labels(self) -> tuple[str, ...]:
        """Labels by the axes of the joint's frame: "z", "x", "angle" for the normal "y"."""
        axes = [_axis_name(axis) for axis in np.asarray(self.basis()).T[:2]] if is_concrete(self.normal) else [""]
        return (*axes, "angle") if all(axes) else self.labels

    def basis(self) -> Matrix3:
        return axis_basis(self.normal)

    def closure(self, R: Array, d: Array) -> Array:
        return jnp.concatenate([d[2:], parallel_rows(R)])

    def faults(self) -> list[str]:
        return axis_faults(self.normal)


def _axis_name(axis):
    """ "x" or "-x" of an axis along one of the joint's frame, empty for others."""
    k = int(np.argmax(np.abs(axis)))
    return ("-" if axis[k] < 0 else "") + "xyz"[k] if np.abs(axis[k]) > 1.0 - 1e-9 else ""
