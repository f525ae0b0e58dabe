"""Position and velocity kinematics: what one pass over the tree evaluates, for every function of a state.

World axes.  Positions, twists, wrenches and inertias refer to an `origin`, a point of the system that is constant in
every derivative: far from the world origin, m r^2 would swamp the inertias about centres of mass.
Twists are (omega, velocity of the point at the origin), wrenches (moment about the origin, force).
"""

import dataclasses
from collections.abc import Callable
from typing import NamedTuple, TypeVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from ..math._spatial import cross_motion, scale
from ..model._internal_states import GroupStates, InternalStates, group_states
from ..model._signals import Signals
from ..model._system import System
from ..runtime import jit
from ._poses import (
    first_body_position,
    frame_poses,
    joint_twists,
    node_inertias,
    node_parameters,
    node_poses,
    shift_origin,
)
from ._tree import ancestors


class ClosureDirections(NamedTuple):
    """Directions of the rows at a configuration, group by group.

    Attributes:
        values: (elements, rows, 6) of every group, the derivative of each row with respect to a world twist of frame
            B relative to frame A; the transpose turns multipliers into wrenches on the body of frame B.
        rows: slopes of the other rows, see `_rows.RowSlopes`; None where they are evaluated when asked.
        rates: function of the rates (R_dot, x_dot) of the frames and psi_dot of the coordinates that gives the rates
            of `values` and `rows` in time; None where they are not needed.
    """

    values: tuple[Array, ...]
    rows: tuple | None = None
    rates: Callable | None = None


class Configuration(eqx.Module):
    """Position kinematics of a mechanism at a time and coordinates.

    Attributes:
        t: time; psi: coordinates (nq,); P: `node_parameters` (nodes, 23).
        W: node poses (nodes, 12); S: joint twists (nodes, 6); J: node inertias (nodes, 10), None if not needed.
        R, x: rotations (frames, 3, 3) and positions (frames, 3) of the frames; origin: (3,) in the world.
        directions: of the rows, None until `closures.with_directions` has evaluated them.
        s: internal states by groups, None without such, or where they are not given.
        signals: of the blocks, None without such, or until `with_signals` has evaluated them.
    """

    t: Array
    psi: Array
    P: Array
    W: Array
    S: Array
    R: Array
    x: Array
    origin: Array
    J: Array | None
    directions: ClosureDirections | None
    s: GroupStates | None
    signals: Signals | None

    @property
    def internal(self) -> InternalStates | None:
        """Internal states as a `State` takes them."""
        return None if self.s is None else self.s.whole

    @property
    def bends(self) -> Array | None:
        """Bends (ns,) of the bristles in joints [m], None without such, or where they are not given."""
        return None if self.s is None else self.s.bends


class VelocityKinematics(Configuration):
    """A configuration with its velocities u (nv,) and the twists V (nodes, 6) of all nodes."""

    u: Array
    V: Array


At = TypeVar("At", bound=Configuration)


def configuration(system: System, P, psi, t, inertias=True, origin=None, internal=None) -> Configuration:
    """Position kinematics at coordinates psi (nq,) and internal states, an `InternalStates` or its values (ns,).

    Args: origin: by default the position of the first body.
    """
    W, S, R, x, origin, J = _tree_kinematics(system.topology, system.frames, P, psi, inertias, origin)
    return Configuration(t, psi, P, W, S, R, x, origin, J, None, group_states(system, internal), None)


@jit  # traced once for all the places of a program
def _tree_kinematics(topology, frames, P, psi, inertias, origin):
    """Poses of the nodes, twists of the columns, rotations and positions of the frames, the origin, inertias."""
    W = node_poses(topology, P, psi)
    origin = first_body_position(topology, W) if origin is None else origin
    W = shift_origin(W, origin)
    J = node_inertias(P, W) if inertias else None
    return W, joint_twists(topology, P, W), *frame_poses(topology, frames, W, origin), origin, J


def at_state(system: System, state, inertias=True) -> Configuration:
    """The configuration of a state."""
    P = node_parameters(system)
    return configuration(system, P, state.coordinates, state.t, inertias, internal=state.internal)


def at_coordinates(system: System, at: Configuration, psi) -> Configuration:
    """Position kinematics at other coordinates, with the same parameters, time and internal states."""
    return dataclasses.replace(configuration(system, at.P, psi, at.t, at.J is not None), s=at.s)


def with_internal(system: System, at: At, internal) -> At:
    """The configuration at other internal states, an `InternalStates` or its values (ns,)."""
    return dataclasses.replace(at, s=group_states(system, internal), signals=None)


def with_velocities(system: System, at: Configuration, u) -> VelocityKinematics:
    """The configuration at velocities u (nv,)."""
    return _velocity_kinematics(at, u, node_motion(system.topology, at.S, u))


def at_rest(system: System, at: Configuration) -> VelocityKinematics:
    """The configuration at rest."""
    return _velocity_kinematics(at, jnp.zeros(system.topology.num_velocities, at.psi.dtype), jnp.zeros_like(at.S))


def _velocity_kinematics(at, u, V):
    known = {field.name: getattr(at, field.name) for field in dataclasses.fields(Configuration)}
    return VelocityKinematics(**known | {"signals": None, "u": u, "V": V})


def column_twists(topology, V):
    """Twist of the node whose frame carries each column (a ball's three columns turn with its child)."""
    return V if topology.is_simple else V[topology.column_frame]


def node_motion(topology, S, u):
    """World twists (nodes, 6, ...) of all nodes at velocities u (nv, ...)."""
    return ancestors(topology.nodes, scale(S, u))


def node_accelerations(topology, at: VelocityKinematics, a):
    """World twist rates (nodes, 6) at accelerations a (nv,): ancestor sum of `S a + S_dot u`."""
    turned = cross_motion(column_twists(topology, at.V), at.S)
    return ancestors(topology.nodes, scale(at.S, a) + scale(turned, at.u))
