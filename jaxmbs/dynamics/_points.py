"""Accelerations of points in the motion that the forces and constraints of a state produce."""

from collections.abc import Mapping

from jaxtyping import Array, Float

from ..assembly._state import HasStates, State
from ..kinematics._points import point_acceleration
from ..model._changes import with_changes
from ..model._entry_points import map_states, rates_of, states_of
from ..model._system import System
from ..runtime import jit
from ..typing import ArrayLike, FrameLike
from ._newton_euler import forward_dynamics


def acceleration(
    system: System,
    state: State | HasStates,
    frame: FrameLike,
    accelerations: ArrayLike | Mapping[str, ArrayLike] | None = None,
) -> Float[Array, "... 3"]:
    """World acceleration (3,) [m/s^2] of a frame's origin or point, by default that of `forward_dynamics`.

    Args:
        state: a State, a Motion, or states with leading axes, which the answer has too.
        frame: a frame or body name, or (name, point).
        accelerations: (nv,) or by joint, instead of those of the motion.

    Raises: ModelError for an unknown frame.
    """
    return _acceleration(system, state, frame, accelerations)[..., :3]


def angular_acceleration(
    system: System,
    state: State | HasStates,
    frame: FrameLike,
    accelerations: ArrayLike | Mapping[str, ArrayLike] | None = None,
) -> Float[Array, "... 3"]:
    """Angular acceleration (3,) [rad/s^2] of a frame in world axes; arguments as for `acceleration`."""
    return _acceleration(system, state, frame, accelerations)[..., 3:]


def _acceleration(system, state, frame, accelerations):
    states = states_of(system, state)
    if accelerations is None:
        rates = forward_dynamics(system, states)[0]
    else:
        rates = rates_of(system, states, accelerations, "accelerations")
    return _along(system, states, frame, rates)


@jit
def _along(system, states, frame, rates):
    return map_states(
        lambda state, rates: point_acceleration(with_changes(system, state), state, frame, rates), states, rates
    )
