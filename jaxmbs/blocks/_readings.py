"""Functions of measures that are given by a joint or by frames."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jax import Array

from ..math._linalg import direction, safe_norm

#: Quantities of a joint, a frame, and two frames.
OF_JOINT = ("position", "velocity")
OF_FRAME = ("position", "velocity", "angular velocity")
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
        "put a stiff spring or a Bushing in place of the joint and measure what it yields",
    ),
}


class JointReading(eqx.Module):
    """Coordinate or velocity of a joint, () of one freedom, else (n,)."""

    joint: str = eqx.field(static=True)
    of: str = eqx.field(static=True)

    def __call__(self, instant: Any) -> Array:
        return (instant.coordinates if self.of == "position" else instant.velocities)[self.joint]


class FrameReading(eqx.Module):
    """Quantity of a frame in world axes (3,), or its entry () along an axis."""

    frame: str = eqx.field(static=True)
    of: str = eqx.field(static=True)
    axis: str | None = eqx.field(static=True)

    def __call__(self, instant: Any) -> Array:
        read = {"position": "position", "velocity": "velocity", "angular velocity": "angular_velocity"}[self.of]
        return _along(getattr(instant, read)(self.frame), self.axis)


class RelativeReading(eqx.Module):
    """Quantity of the second of two frames, seen in the axes of the first (3,), or its entry () along an axis."""

    first: str = eqx.field(static=True)
    second: str = eqx.field(static=True)
    of: str = eqx.field(static=True)
    axis: str | None = eqx.field(static=True)

    def __call__(self, instant: Any) -> Array:
        R, omega = instant.rotation(self.first), instant.angular_velocity(self.first)
        if self.of == "angular velocity":
            return _along(R.T @ (instant.angular_velocity(self.second) - omega), self.axis)
        d = instant.position(self.second) - instant.position(self.first)
        if self.of == "distance":
            return safe_norm(d)
        if self.of == "position":
            return _along(R.T @ d, self.axis)
        v = instant.velocity(self.second) - instant.velocity(self.first)
        if self.of == "distance rate":
            return jnp.dot(direction(d), v)
        return _along(R.T @ (v - jnp.cross(omega, d)), self.axis)


def _along(vector, axis):
    return vector if axis is None else vector[AXES.index(axis)]
