"""Interface of a pair of surfaces: the points where they touch, and how deep."""

import abc
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..drawings import Drawing
from ..forces._fields import value_faults
from ..forces._validity import Margin
from ..tables import fields_repr
from ..typing import Matrix3, Vector3


class Touch(NamedTuple):
    """Points of contact (k,) of a pair, in the axes of frame A, from its origin.

    Attributes:
        depth: (k,) of the overlap, negative is the gap [m].
        normal: (k, 3) unit vectors towards the body of B.
        point: (k, 3) in the middle of the overlap [m].
        share: (k,) of the stiffness that each point has; they add up to one.
    """

    depth: Float[Array, " k"]
    normal: Float[Array, "k 3"]
    point: Float[Array, "k 3"]
    share: Float[Array, " k"]


class AbstractPair(eqx.Module):
    """A surface on frame A and a round part on frame B.

    The derivative of each depth by the motion of B is minus its normal at the point of contact, so that the force of
    the depth keeps its energy.
    """

    __repr__ = fields_repr

    @abc.abstractmethod
    def touch(self, rotation: Matrix3, displacement: Vector3) -> Touch:
        """Points of contact.

        Args:
            rotation: (3, 3) `R_A^T R_B`, B axes in A axes.
            displacement: (3,) origin of B from that of A, in A axes [m].
        """

    @abc.abstractmethod
    def area(self, depth: Float[Array, " k"]) -> Float[Array, " k"]:
        """Area [m^2] by which each force is divided to have a mean pressure, of positive depths."""

    def touch_points(self, rotation: Matrix3, displacement: Vector3) -> Float[Array, "k 3"]:
        """Points where the surfaces touch, NaN where they are apart; arguments as of `touch`."""
        found = self.touch(rotation, displacement)
        return jnp.where(found.depth[:, None] > 0.0, found.point, jnp.nan)

    def drawing(self) -> Drawing:
        """Shapes (`jaxmbs.drawings`) of both surfaces, in frames 0 (A) and 1 (B); none by default."""
        return ()

    def validity(self, rotation: Matrix3, displacement: Vector3) -> dict[str, Margin]:
        """Margins of the pose to the ends of the model by name; none by default."""
        return {}

    @property
    def has_ends(self) -> bool:
        """True if `validity` has margins."""
        return type(self).validity is not AbstractPair.validity

    def faults(self) -> list[str]:
        """Faults of the values, one message each; traced values are not checked."""
        return value_faults(self)


def round_touch(centre: Vector3, normal: Vector3, depth, radius) -> Touch:
    """The one point of contact of a round part with its centre and radius."""
    point = centre - (radius - depth / 2) * normal
    return Touch(depth[None], normal[None], point[None], jnp.ones((1,), point.dtype))
