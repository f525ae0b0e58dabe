"""Results that a law has at an instant: named numbers, loads at points of contact, and forces for arrows."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..runtime import as_array
from ..tables import fields_repr
from ..typing import Convertible


class Reading(eqx.Module):
    """A named result of a law.

    Attributes:
        value: one number (), or one at each of the `places` (k,).
        unit: of the value, such as "N"; empty for none (static).
        places: names of the places (static), () for one number.
    """

    value: Convertible[Float[Array, "..."]] = eqx.field(converter=as_array)
    unit: str = eqx.field(static=True, default="")
    places: tuple[str, ...] = eqx.field(static=True, default=())

    __repr__ = fields_repr


class Arrows(NamedTuple):
    """Points (k, 3) [m] and forces (k, 3) [N] on the body there."""

    points: Array
    forces: Array


class PointLoads(NamedTuple):
    """Loads at points of contact (k,) between two frames, in the axes of the first, from its origin.

    Attributes:
        depth: of the overlap, negative is the gap [m]; rate [m/s].
        point: (k, 3) in the middle of the overlap [m].
        normal: (k, 3) unit vectors towards the body of the second frame.
        normal_force: on this body along the normal, never negative [N].
        friction: (k, 3) on this body [N].
        sliding: (k, 3) its velocity over the other one [m/s].
        area: by which the normal force is divided to have a mean pressure [m^2], zero where there is none.
        wear: () worn volume over force and way [m^2/N].
    """

    depth: Array
    rate: Array
    point: Array
    normal: Array
    normal_force: Array
    friction: Array
    sliding: Array
    area: Array
    wear: Array

    @property
    def arrows(self) -> Arrows:
        """The forces at the points."""
        return Arrows(self.point, self.normal_force[:, None] * self.normal + self.friction)

    @property
    def readings(self) -> dict[str, Reading]:
        """Depth, forces and speed at each point."""
        places = tuple(f"point {k}" for k in range(self.depth.shape[0]))
        size = lambda x: jnp.sqrt(jnp.sum(x**2, axis=-1))
        return {
            "depth": Reading(self.depth, "m", places),
            "normal force": Reading(self.normal_force, "N", places),
            "friction": Reading(size(self.friction), "N", places),
            "sliding speed": Reading(size(self.sliding), "m/s", places),
        }


def is_own(law: Any, method: str, *bases: type) -> bool:
    """True if the class of a law defines a method itself, in place of that of a base class."""
    own = getattr(type(law), method, None)
    return own is not None and all(own is not getattr(base, method, None) for base in bases)
