"""Poses: where one frame stands in another."""

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from ..math.host import as_array
from ..typing import ArrayLike


class Pose(eqx.Module):
    """Position (..., 3) [m] and rotation matrix (..., 3, 3) of a frame in another frame."""

    position: Float[Array, "... 3"]
    rotation: Float[Array, "... 3 3"]

    def __init__(self, position: ArrayLike = (0.0, 0.0, 0.0), rotation: ArrayLike | None = None) -> None:
        self.position = as_array(position)
        self.rotation = as_array(np.eye(3) if rotation is None else rotation)

    def __matmul__(self, other: "Pose") -> "Pose":
        """The pose of `other`, given in this frame, in the frame that this one is given in."""
        return Pose(self.position + self.rotation @ other.position, self.rotation @ other.rotation)

    def inverse(self) -> "Pose":
        """The pose of the reference frame in this one."""
        return Pose(-self.rotation.T @ self.position, self.rotation.T)
