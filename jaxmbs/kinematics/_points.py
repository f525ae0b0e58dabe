"""Position, velocity, acceleration and Jacobian of any frame or point."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import no_such
from ..errors import UnknownNameError
from ..math._spatial import to_public_order
from ..model._entry_points import state_function
from ..model._system import AbstractState, System
from ..runtime import as_array
from ..typing import FrameLike, Matrix3, Vector3
from ._configuration import configuration
from ._poses import coordinate_rate, node_parameters, node_poses


def locate_frame(system: System, frame):
    """Node, position and rotation in node axes of a frame given by name, body name, or (name, point).

    Raises: UnknownNameError.
    """
    if not isinstance(frame, str) and not (isinstance(frame, tuple | list) and len(frame) == 2):
        raise TypeError(f"a frame is the name of a frame or body, or (name, point), not {frame!r}")
    name, point = (frame, None) if isinstance(frame, str) else frame
    top = system.topology
    if name not in top.frame_index:
        raise UnknownNameError(no_such("body or frame", name, top.frame_names))
    index = top.frame_index[name]
    position, rotation = system.frames.position[index], system.frames.rotation[index]
    if point is not None:
        position = position + rotation @ _as_point(name, point)
    return top.frame_node[index], position, rotation


def _as_point(name, point):
    point = as_array(point)
    if point.shape != (3,):
        raise ValueError(f"a point of {name!r} needs three numbers, got shape {point.shape}")
    return point


def _world_pose(system, P, psi, place):
    node, position, rotation = place
    if node < 0:
        return rotation, position
    w = node_poses(system.topology, P, psi)[node]
    R = w[:9].reshape(3, 3)
    return R @ rotation, w[9:] + R @ position


@state_function
def position(system: System, state: AbstractState, frame: FrameLike) -> Vector3:
    """World position (3,) [m] of a frame's origin or of a point (frame, point)."""
    return _world_pose(system, node_parameters(system), state.coordinates, locate_frame(system, frame))[1]


@state_function
def rotation(system: System, state: AbstractState, frame: FrameLike) -> Matrix3:
    """World rotation (3, 3) of a frame."""
    return _world_pose(system, node_parameters(system), state.coordinates, locate_frame(system, frame))[0]


@state_function
def velocity(system: System, state: AbstractState, frame: FrameLike) -> Vector3:
    """World velocity (3,) [m/s] of a frame's origin or of a point (frame, point)."""
    return (jacobian(system, state, frame) @ state.velocities)[:3]


@state_function
def angular_velocity(system: System, state: AbstractState, frame: FrameLike) -> Vector3:
    """Angular velocity (3,) [rad/s] of a frame, world axes."""
    return (jacobian(system, state, frame) @ state.velocities)[3:]


def point_acceleration(system: System, state, frame, rates):
    """Acceleration, then angular acceleration (6,) of a frame, world axes, at accelerations `rates` (nv,)."""

    def speed(psi):
        return jacobian(system, eqx.tree_at(lambda s: s.coordinates, state, psi), frame) @ state.velocities

    psi_dot = coordinate_rate(system.topology, state.coordinates, state.velocities)
    bias = jax.jvp(speed, (state.coordinates,), (psi_dot,))[1]
    return bias + jacobian(system, state, frame) @ rates


@state_function
def jacobian(system: System, state: AbstractState, frame: FrameLike) -> Float[Array, "6 nv"]:
    """Jacobian (6, nv) of a frame: velocity of its origin, then angular velocity, world axes, per velocity.

    Source: S2 (11)-(12), (14)-(15) with every joint independent.
    """
    P, place = node_parameters(system), locate_frame(system, frame)
    at = configuration(system, P, state.coordinates, state.t, inertias=False)
    point = _world_pose(system, P, state.coordinates, place)[1] - at.origin
    return to_public_order(point_jacobian(system, at.S, place[0], point), 0)


def point_jacobian(system: System, S, node, point):
    """(6, nv) angular velocity, then velocity of the `point` carried by `node` (-1: the ground), per velocity; the
    point is seen from where the twists S refer to.

    Source: S2 (11)-(12), (14)-(15) with every joint independent, 1 - alpha and alpha as S carries them.
    """
    path = np.vstack([system.topology.nodes.path, np.zeros((1, system.topology.nodes.size), bool)])[node]
    twist = S * jnp.asarray(path, S.dtype)[:, None]
    linear = twist[:, 3:] + jax.vmap(jnp.cross, in_axes=(0, None))(twist[:, :3], point)
    return jnp.concatenate([twist[:, :3], linear], axis=1).T
