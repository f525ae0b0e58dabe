"""Interface of roads, and the flat one."""

import abc
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..drawings import Drawing, Plane
from ..forces._fields import value_faults
from ..forces._validity import Margin
from ..tables import fields_repr
from ..typing import Vector3


class AbstractRoad(eqx.Module):
    """A road over the plane x y of its frame, solid below z = height.

    `is_plane` says that one plane serves everywhere.
    """

    is_plane: ClassVar[bool] = False
    __repr__ = fields_repr

    @abc.abstractmethod
    def height(self, x: Any, y: Any) -> Any:
        """Height () [m] at a place [m]."""

    def slopes(self, x: Any, y: Any) -> tuple[Any, Any]:
        """Slopes () of the height along x and y."""
        import jax

        return jax.grad(self.height, argnums=(0, 1))(jnp.asarray(x, float), jnp.asarray(y, float))

    def plane(self, place: Any, ahead: Any) -> tuple[Vector3, Vector3]:
        """A point (3,) of the road and its normal (3,), as a wheel at a place (2,), ahead (2,), feels it."""
        along, across = self.slopes(place[0], place[1])
        point = jnp.stack([place[0], place[1], self.height(place[0], place[1])])
        steep = jnp.stack([-along, -across, jnp.ones_like(along)])
        return point, steep / jnp.sqrt(jnp.sum(steep * steep))

    def validity(self, place: Any) -> dict[str, Margin]:
        """Margins of a contact at a place (2,) to the ends of what is known of the road; none by default."""
        return {}

    def drawing(self) -> Drawing:
        """Shapes in frame 0; by default the plane."""
        return (Plane(0),)

    def faults(self) -> list[str]:
        """Faults of the values, one message each; traced values are not checked."""
        return value_faults(self)


class FlatRoad(AbstractRoad):
    """The plane z = 0 of the road's frame."""

    is_plane: ClassVar[bool] = True

    def height(self, x: Any, y: Any) -> Any:
        return jnp.zeros_like(jnp.asarray(x, float))

    def plane(self, place: Any, ahead: Any) -> tuple[Vector3, Vector3]:
        return jnp.zeros(3, place.dtype), jnp.asarray(np.array([0.0, 0.0, 1.0]), place.dtype)
