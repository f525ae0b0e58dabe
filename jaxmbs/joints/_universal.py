"""Universal (Cardan) joint: two crossing axes, the first fixed in the parent, the second in the child."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import is_concrete
from ..typing import Convertible, Matrix3
from ._base import AbstractJoint, Node, axis_direction


class Universal(AbstractJoint):
    """Rotation about `axes[0]` of the parent frame, then about `axes[1]` of the child frame.

    Coordinates: first angle [rad], about the parent's axis, then second angle [rad], about the child's; right-handed,
    zero where the frames agree.  Velocities: their rates [rad/s].  Efforts: moments about the two axes [N m].
    Where it rubs it has a surface on each axis of its cross, and each of them bears the whole force across its axis:
    `joint_friction` has two loads, and their sum is no force that the joint transmits; its power is that of both.
    The axes must be at right angles.  The second angle at +-pi/2 brings no singularity (the axes stay crossed).
    """

    nodes = (Node("revolute", "x"), Node("revolute", "y"))
    labels = ("first", "second")
    row_units = ("m", "m", "m", "rad")
    symbol = "cross"

    axes: Convertible[Float[Array, "2 3"]] = eqx.field(
        converter=lambda axes: jnp.stack([axis_direction(a) for a in axes]), default=("x", "y")
    )

    def basis(self) -> Matrix3:
        x = self.axes[0] / jnp.linalg.norm(self.axes[0])
        y = self.axes[1] - jnp.dot(self.axes[1], x) * x
        y = y / jnp.linalg.norm(y)
        return jnp.stack([x, y, jnp.cross(x, y)], axis=1)

    def closure(self, R: Array, d: Array) -> Array:
        return jnp.concatenate([d, R[0, 1][None]])

    def faults(self) -> list[str]:
        if not is_concrete(self.axes):
            return []
        a, b = np.asarray(self.axes)
        sine = np.linalg.norm(np.cross(a, b))
        if not (np.isfinite(sine) and sine > 1e-12):  # rounding of parallel unit vectors stays far below
            return ["its two axes are zero, parallel or not finite"]
        square = abs(a @ b) <= 1e-9 * sine
        return [] if square else ["its two axes are not at right angles"]
