"""Functions of measures that are given by a joint or by frames."""

import abc
from typing import Any, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array

from ..math._linalg import direction, safe_norm

#: Of each measure of a group the names of its joint or frames.
Places: TypeAlias = tuple[tuple[str, ...], ...]
#: Quantities of a joint, a frame, and two frames.
OF_JOINT = ("position", "velocity")
OF_FRAME = ("position", "velocity", "angular velocity")
OF_FORCE = ("effort",)
OF_FRAMES = ("position", "velocity", "angular velocity", "distance", "distance rate")
AXES = ("x", "y", "z")
#: Quantities that are no signals, with the way out of each.
REFUSED = {
    **dict.fromkeys(
        ("acceleration", "accelerations", "angular acceleration"),
        "measure the velocity and filter it: TransferFunction([1, 0], [tau, 1]) has its rate",
    ),
    **dict.fromkeys(
        ("reaction", "reactions", "force", "torque", "effort", "load"),
        "put a stiff spring or a Bushing in place of the joint and measure its effort, b.measure(..., force=name)",
    ),
}


class AbstractReading(eqx.Module):
    """A way to read signals from a mechanism."""

    @abc.abstractmethod
    def values(self, instant: Any, places: Places) -> Array:
        """Values (n, ...) at a `signal_flow.Instant`, of joints or frames of these names."""


class FunctionReading(AbstractReading):
    """`function(instant)` of the user."""

    function: Any

    def values(self, instant: Any, places: Places) -> Array:
        """Values (1, ...): a function stands alone in its group."""
        return jnp.asarray(self.function(instant))[None]


class JointReading(AbstractReading):
    """Coordinate or velocity of a joint, () of one freedom, else (n,)."""

    of: str = eqx.field(static=True)

    def values(self, instant: Any, places: Places) -> Array:
        """Values (n, ...) of the joints."""
        return instant.of_joints([joint for (joint,) in places], self.of)


class ForceReading(AbstractReading):
    """Effort of a force element, () of one number, else (n,)."""

    axis: str | None = eqx.field(static=True)

    def values(self, instant: Any, places: Places) -> Array:
        """Values (n, ...) of the elements."""
        found = instant.efforts_of([element for (element,) in places])
        return found if self.axis is None else found[:, AXES.index(self.axis)]


class FrameReading(AbstractReading):
    """Quantity of a frame in world axes (3,), or its entry () along an axis."""

    of: str = eqx.field(static=True)
    axis: str | None = eqx.field(static=True)

    def values(self, instant: Any, places: Places) -> Array:
        """Values (n, ...) of the frames."""
        frames = [frame for (frame,) in places]
        if self.of == "position":
            return _along(instant.positions(frames), self.axis)
        read = instant.origin_velocities if self.of == "velocity" else instant.angular_velocities
        return _along(read(frames), self.axis)


class RelativeReading(AbstractReading):
    """Quantity of the second of two frames, seen in the axes of the first (3,), or its entry () along an axis."""

    of: str = eqx.field(static=True)
    axis: str | None = eqx.field(static=True)

    def values(self, instant: Any, places: Places) -> Array:
        """Values (n, ...) of the pairs of frames."""
        first, second = zip(*places, strict=True)

        def between(read):
            return read(second) - read(first)

        if self.of == "distance":
            return jax.vmap(safe_norm)(between(instant.positions))
        if self.of == "distance rate":
            along = jax.vmap(direction)(between(instant.positions))
            return jnp.sum(along * between(instant.origin_velocities), axis=1)
        if self.of == "position":
            seen = between(instant.positions)
        elif self.of == "angular velocity":
            seen = between(instant.angular_velocities)
        else:
            turned = jnp.cross(instant.angular_velocities(first), between(instant.positions))
            seen = between(instant.origin_velocities) - turned
        return _along(jnp.einsum("nji,nj->ni", instant.rotations(first), seen), self.axis)


def _along(vectors, axis):
    return vectors if axis is None else vectors[:, AXES.index(axis)]
