"""Rolling contacts and blades: rows of position for contact, rows of velocity for no slip (nonholonomic).

`reactions` gives the contact force of each under the constraint's name, on the body of frame B.
"""

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import is_concrete
from ..drawings import Ball, Drawing, Plane, Rail, Wheel
from ..palette import STEEL
from ..runtime import as_array
from ..typing import ArrayLike, Axis, Convertible
from ._base import axis_direction, axis_faults
from ._closures import AbstractClosure


class AbstractRolling(AbstractClosure):
    """Rolling without slip on the x-y plane of frame A: `contact(R)` points from B's origin to the touching point."""

    row_units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    num_slips: ClassVar[int] = 2

    radius: eqx.AbstractVar[Float[Array, ""]]

    def contact(self, R: Array) -> Array:
        """Vector (3,) [m] from the centre to the contact point, in the axes of frame A."""
        raise NotImplementedError

    def closure(self, R: Array, d: Array) -> Array:
        return (d + self.contact(R))[2:]

    def slip(self, R: Array, d: Array, omega: Array, v: Array) -> Array:
        return (v + jnp.cross(omega, self.contact(R)))[:2]

    def faults(self) -> list[str]:
        bad = is_concrete(self.radius) and not (np.isfinite(self.radius) and self.radius > 0)
        return ["its radius is not positive"] if bad else []


class RollingSphere(AbstractRolling):
    """A sphere of `radius` [m] about the origin of frame B rolls on the x-y plane of frame A, z pointing out.

    Three rows: the distance from the plane [m], positive along z of A, then the slips of the touching point along x
    and y of A [m/s].  `reactions` gives the contact force on the body of frame B [N].
    """

    radius: Convertible[Float[Array, ""]] = eqx.field(converter=as_array)

    def drawing(self) -> Drawing:
        return Plane(0), Ball(self.radius, 1, is_clear=True, color=STEEL)

    def contact(self, R: Array) -> Array:
        return jnp.zeros(3).at[2].set(-self.radius)


class RollingDisk(AbstractRolling):
    """A thin disk or wheel about the origin of frame B rolls on the x-y plane of frame A, z pointing out.

    Args:
        radius: [m].
        axle: axis of the disk in frame B: "x", "y", "z" or three numbers.

    Three rows: the distance from the plane [m], positive along z of A, then the slips of the touching point along x
    and y of A [m/s].  `reactions` gives the contact force on the body of frame B [N].  The disk may lean, but not lie
    flat (the touching point is undetermined there).
    """

    radius: Float[Array, ""]
    axle: Float[Array, "3"]

    def __init__(self, radius: ArrayLike, axle: Axis = "y") -> None:
        self.radius = as_array(radius)
        self.axle = axis_direction(axle)

    def drawing(self) -> Drawing:
        return Plane(0), Wheel(self.radius, 0.12 * self.radius, 1, self.axle, STEEL)

    def contact(self, R: Array) -> Array:
        axle = R @ (self.axle / jnp.sqrt(jnp.sum(self.axle**2)))
        down = axle * axle[2] - jnp.eye(3)[2]
        # a disk that lies flat touches everywhere: 1e-12, of the sine squared, bounds the derivative there
        return self.radius * down / jnp.sqrt(jnp.maximum(1.0 - axle[2] ** 2, 1e-12))

    def faults(self) -> list[str]:
        return [*super().faults(), *axis_faults(self.axle)]


class KnifeEdge(AbstractClosure):
    """A blade or skate at the origin of frame B: in the x-y plane of frame A it moves along itself, not across.

    Args:
        along: direction of the blade in frame B: "x", "y", "z" or three numbers.

    One row: the speed across the blade [m/s], positive to its left, looked at from +z of A.  `reactions` gives the
    force on the body of frame B [N].
    """

    row_units: ClassVar[tuple[str, ...]] = ("m",)
    num_slips: ClassVar[int] = 1

    along: Float[Array, "3"]

    def __init__(self, along: Axis = "x") -> None:
        self.along = axis_direction(along)

    def drawing(self) -> Drawing:
        return Plane(0), Rail(1, self.along, is_short=True)

    def slip(self, R: Array, d: Array, omega: Array, v: Array) -> Array:
        x, y, _ = R @ self.along
        return ((x * v[1] - y * v[0]) / jnp.sqrt(x * x + y * y))[None]

    def faults(self) -> list[str]:
        return axis_faults(self.along)
