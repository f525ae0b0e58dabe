"""Poses: position and rotation of one frame in another."""

from functools import lru_cache

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import any_concrete, are_axes, faults_if
from ..runtime import as_array, not_tracing
from ..tables import fields_repr
from ..typing import ArrayLike


def _no_rotation():
    """The unit matrix, one array for all poses outside of traces."""
    return _unit_matrix(jnp.result_type(float)) if not_tracing() else jnp.eye(3)


@lru_cache
def _unit_matrix(dtype):
    return as_array(np.eye(3), dtype)


class Pose(eqx.Module):
    """Position (..., 3) [m] and rotation matrix (..., 3, 3) of a frame in another frame.

    Raises: ValueError for other shapes, TypeError for complex numbers.
    """

    position: Float[Array, "... 3"]
    rotation: Float[Array, "... 3 3"]

    __repr__ = fields_repr

    def __init__(self, position: ArrayLike = (0.0, 0.0, 0.0), rotation: ArrayLike | None = None) -> None:
        self.position = as_array(position)
        self.rotation = _no_rotation() if rotation is None else as_array(rotation)
        if self.position.shape[-1:] != (3,):
            raise ValueError(f"a point needs three numbers, got shape {self.position.shape}")
        if self.rotation.shape[-2:] != (3, 3):
            raise ValueError(
                f"a rotation is a matrix of shape (3, 3), got shape {self.rotation.shape}; "
                "`mbs.rotations` makes one of a quaternion, a rotation vector, or an axis and an angle"
            )

    def faults(self) -> list[str]:
        """Faults of the numbers of one pose, where they are concrete."""
        return faults_if(
            (self.position.shape != (3,) or self.rotation.shape != (3, 3), "it is a stack of poses, not one pose"),
            (any_concrete(lambda x: ~np.isfinite(x), self.position), "its point is not finite"),
            (self.rotation.ndim == 2 and not are_axes(self.rotation), "its rotation is not a rotation matrix"),
        )

    def __matmul__(self, other: "Pose") -> "Pose":
        """The pose of `other`, given in this frame, in the frame that this one is given in."""
        return Pose(self.position + self.rotation @ other.position, self.rotation @ other.rotation)

    def inverse(self) -> "Pose":
        """The pose of the reference frame in this one."""
        return Pose(-self.rotation.T @ self.position, self.rotation.T)
