"""Accelerations of points in the motion that the forces and constraints of a state produce."""

from collections.abc import Mapping

from ..kinematics.points import point_acceleration
from ..kinematics.state import State
from ..model.question import check_fits, rates_of
from ..model.system import System
from ..typing import ArrayLike, FrameLike, Vector3
from .newton_euler import forward_dynamics


def acceleration(
    system: System, state: State, frame: FrameLike, accelerations: ArrayLike | Mapping[str, ArrayLike] | None = None
) -> Vector3:
    """World acceleration (3,) [m/s^2] of a frame's origin or point, by default that of `forward_dynamics`.

    Args:
        frame: a frame or body name, or (name, point).
        accelerations: (nv,) or by joint, instead of those of the motion.

    Raises: ModelError for an unknown frame.
    """
    return _acceleration(system, state, frame, accelerations)[:3]


def angular_acceleration(
    system: System, state: State, frame: FrameLike, accelerations: ArrayLike | Mapping[str, ArrayLike] | None = None
) -> Vector3:
    """Angular acceleration (3,) [rad/s^2] of a frame in world axes; arguments as for `acceleration`."""
    return _acceleration(system, state, frame, accelerations)[3:]


def _acceleration(system, state, frame, accelerations):
    check_fits(system, state)
    if accelerations is None:
        return point_acceleration(system, state, frame, forward_dynamics(system, state)[0])
    rates = rates_of(system, state, accelerations, "accelerations")
    return point_acceleration(system, state, frame, rates)
