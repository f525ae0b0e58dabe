"""From the motion of a mechanism back to an elastic body: deformations, displacements of nodes, interface loads."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from ..dynamics.newton_euler import accelerations_at, node_accelerations, node_motion
from ..errors import ModelError
from ..kinematics.elastic import elastic_state, flow_rate, gathered
from ..kinematics.poses import geometry, node_inertias, node_parameters
from ..kinematics.state import State
from ..model.system import System
from ..substructures import recovery
from .floating_frame import FloatingFrame, interface_rows, turned


class _Motion(NamedTuple):
    """Deformations q, q_dot (m,), acceleration less gravity of all coordinates (n,), floating axes."""

    q: Array
    q_dot: Array
    felt: Array


def deformations(system: System, motion, name: str):
    """Deformations q (..., m) of an elastic body and their rates, at a state or along a motion.

    Six of each other interface (displacement [m], rotation vector [rad], seen from the first and in its axes), then
    the modal coordinates.

    Raises: ModelError for an unknown name.
    """
    group, index = _find(system, name)
    return _mapped(lambda state: _deformations(system, group, index, state), motion)


def displacements(system: System, motion, name: str, frame: FloatingFrame, method: str = "acceleration"):
    """Displacements (..., n) of all coordinates of an elastic body's substructure, seen from its first interface.

    Args: method: "acceleration": the interior from the balance of forces, inertia of the whole motion included, or
        "displacement": what the kept shapes show.

    `structures.element_forces` and `element_stresses` take them.

    Raises: ModelError for an unknown name, ValueError for an unknown method.  Source: S1 (31).
    """
    if method not in ("acceleration", "displacement"):
        raise ValueError(f"method must be 'acceleration' or 'displacement', got {method!r}")
    group, index = _find(system, name)
    if method == "displacement":
        return _mapped(lambda state: frame.shapes @ _deformations(system, group, index, state)[0], motion)
    return _mapped(lambda state: _recovered(frame, _motion(system, group, index, frame, state)), motion)


def interface_loads(system: System, motion, name: str, frame: FloatingFrame):
    """Forces [N] and moments [N m] (..., interfaces, 6) that act on an elastic body at its interfaces.

    In the axes of the floating frame, about each interface; from its own equilibrium, `R_i = (K x + C x' + M x'')_i`.

    Raises: ModelError for an unknown name.  Source: S1 (30).
    """
    group, index = _find(system, name)
    s, rows = frame.substructure, interface_rows(frame.substructure, frame.body.interfaces)

    def loads(state):
        moving = _motion(system, group, index, frame, state)
        x_dot = frame.shapes @ moving.q_dot
        x = _recovered(frame, moving)
        force = recovery.interface_forces(s.stiffness, s.mass, rows, x, moving.felt, None, s.damping, x_dot)
        return force.reshape(-1, 6)

    return _mapped(loads, motion)


def _recovered(frame, moving):
    s = frame.substructure
    rows = interface_rows(s, frame.body.interfaces)
    x, x_dot = frame.shapes @ moving.q, frame.shapes @ moving.q_dot
    if len(rows) == s.num_rows:
        return x
    return recovery.mode_acceleration(s.stiffness, s.mass, rows, x, moving.felt, None, s.damping, x_dot)


def _find(system, name):
    for group in system.elastic:
        if name in group.names:
            return group, group.names.index(name)
    names = [n for group in system.elastic for n in group.names]
    raise ModelError([f"{name!r} is not an elastic body; there are: {', '.join(names) or 'none'}"])


def _mapped(function, motion):
    states = motion if isinstance(motion, State) else motion.states
    return eqx.filter_jit(function if states.coordinates.ndim == 1 else jax.vmap(function))(states)


def _of_body(group, index, tree):
    return jax.tree.map(lambda x: x[index], (group.body, tree))


def _deformations(system, group, index, state):
    geo = geometry(system, node_parameters(system), state.coordinates)
    V = node_motion(system.topology, geo.S, state.velocities)
    s = _of_body(group, index, elastic_state(system, group, geo, state.coordinates, V, state.velocities))[1]
    return s.q, s.flow[6:]


def _motion(system, group, index, frame, state):
    """What the body feels: its acceleration less gravity at every coordinate."""
    P, psi, u, t = node_parameters(system), state.coordinates, state.velocities, state.t
    geo = geometry(system, P, psi)
    V = node_motion(system.topology, geo.S, u)
    a, _ = accelerations_at(system, geo, node_inertias(P, geo.W), V, psi, u, t)
    V_dot = node_accelerations(system.topology, geo.S, V, u, a)
    body, s = _of_body(group, index, elastic_state(system, group, geo, psi, V, u))
    rate = flow_rate(body, s, *_of_body(group, index, gathered(system, group, V_dot, a))[1])

    def points(q, flow):
        """Velocities y (n,) of all coordinates."""
        carried = jnp.einsum("a,anm,m->n", flow[:3], turned(frame.substructure, frame.shapes), q)
        return frame.rigid @ flow[:6] + carried + frame.shapes @ flow[6:]

    y, y_dot = jax.jvp(points, (s.q, s.flow), (s.flow[6:], rate))
    turning = jnp.einsum("a,anm->n", s.flow[:3], turned(frame.substructure, y[:, None]))
    return _Motion(s.q, s.flow[6:], y_dot + turning - frame.rigid[:, 3:] @ (system.gravity @ s.R))
