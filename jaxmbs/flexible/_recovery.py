"""Recovery of deformations, nodal displacements and interface loads of elastic bodies from a mechanism's motion."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array

from ..assembly._state import HasStates, State
from ..checks import no_such
from ..dynamics._elastic import inverse_dynamics_load
from ..dynamics._newton_euler import accelerations
from ..errors import UnknownNameError
from ..kinematics._configuration import at_state, node_accelerations, with_velocities
from ..kinematics._elastic import elastic_state, flow_rate, interface_rates
from ..math._rotation import rotation_vector_rate
from ..math._spatial import to_public_order
from ..model._changes import with_changes
from ..model._elastic import ElasticGroup
from ..model._entry_points import states_of
from ..model._system import System
from ..reductions import _recovery as recovery
from ..runtime import as_argument, jit
from ._floating_frame import FloatingFrame
from ._rigid_motions import rotated_shapes, rows_of_interfaces


class BodyMotion(NamedTuple):
    """Deformations q (m,), displacements x, x_dot (n,) of the kept shapes, load (n,) of inertia and gravity, and the
    wrench (6,) that all interfaces together must put on the body, about the first; floating axes.

    Of the load also its parts: nodal velocities y and their rates y_dot (n,), spin and gravity (3,)."""

    q: Array
    x: Array
    x_dot: Array
    load: Array
    wrench: Array
    y: Array
    y_dot: Array
    spin: Array
    gravity: Array


def deformations(system: System, motion: State | HasStates, name: str) -> tuple[Array, Array]:
    """Deformations q (..., m) of an elastic body and their rates, at a state or along a motion.

    Six of each other interface (displacement [m], rotation vector [rad], seen from the first and in its axes), then
    the modal coordinates.

    Raises: UnknownNameError.
    """
    find_body(system, name)
    return along_states(system, lambda here, state: _deformations(here, name, state), motion)


def displacements(
    system: System, motion: State | HasStates, name: str, frame: FloatingFrame, method: str = "acceleration"
) -> Array:
    """Displacements (..., n) of an elastic body's substructure relative to its first interface.

    Args: method: "acceleration": the interior from the balance of forces, with the inertia of the whole motion, or
        "displacement": from the retained shapes.

    `frame.expand` expands them through rigid nodes to the structure, for `fem.element_forces` and `element_stresses`.

    Raises: UnknownNameError, ValueError for an unknown method.  Source: S1 (31).
    """
    if method not in ("acceleration", "displacement"):
        raise ValueError(f"method must be 'acceleration' or 'displacement', got {method!r}")
    find_body(system, name)
    if method == "displacement":
        return along_states(system, lambda here, state: frame.shapes @ _deformations(here, name, state)[0], motion)
    return along_states(
        system, lambda here, state: recover_displacements(frame, body_motion(here, name, frame, state)), motion
    )


def interface_loads(system: System, motion: State | HasStates, name: str, frame: FloatingFrame) -> Array:
    """Forces [N] and moments [N m] (..., interfaces, 6) that act on an elastic body at its interfaces.

    They are in the axes of the floating frame, about the displaced interfaces: of the first interface from the
    equilibrium of the whole deformed body, of the others from that of the elements, `R_i = (K x + C x' + M x'')_i`.

    Raises: UnknownNameError.  Source: S1 (25), (30).
    """
    find_body(system, name)
    s, rows = frame.system, rows_of_interfaces(frame.system, frame.body.interfaces)

    def loads(here, state):
        motion = body_motion(here, name, frame, state)
        still, x = jnp.zeros_like(motion.x), recover_displacements(frame, motion)
        load = recovery.interface_forces(s.with_interface(*rows), x, still, motion.load, motion.x_dot)
        others, moved = load.reshape(-1, 6)[1:], motion.q[: len(rows) - 6].reshape(-1, 6)
        force, moment = others[:, :3], jax.vmap(_physical_moment)(moved[:, 3:], others[:, 3:])
        arms = frame.body.places + moved[:, :3]
        first = motion.wrench - jnp.concatenate(
            [jnp.sum(moment + jnp.cross(arms, force), axis=0), jnp.sum(force, axis=0)]
        )
        return jnp.concatenate([to_public_order(first)[None], jnp.concatenate([force, moment], axis=1)])

    return along_states(system, loads, motion)


def _physical_moment(vector, load):
    """Moment (3,) of a load on the rates of a rotation vector."""
    return jax.linear_transpose(lambda omega: rotation_vector_rate(vector, omega), load)(load)[0]


def recover_displacements(frame: FloatingFrame, motion: BodyMotion) -> Array:
    """Displacements (n,) of the substructure by its balance of forces; those of the interfaces are kept."""
    s = frame.system
    rows = rows_of_interfaces(s, frame.body.interfaces)
    if len(rows) == s.num_rows:
        return motion.x
    still = jnp.zeros_like(motion.x)
    return recovery.mode_acceleration(s.with_interface(*rows), motion.x, still, motion.load, motion.x_dot)


def find_body(system: System, name: str) -> tuple[ElasticGroup, int]:
    """Group of an elastic body and its place in it.  Raises: UnknownNameError."""
    for group in system.elastic:
        if name in group.names:
            return group, group.names.index(name)
    names = [n for group in system.elastic for n in group.names]
    raise UnknownNameError(no_such("elastic body", name, names))


def along_states(system: System, function: Callable, motion: State | HasStates) -> Any:
    """Values of a function of the system in force and one state, at a state or along a motion."""
    states = states_of(system, motion)
    first = jax.eval_shape(lambda: jax.tree.map(lambda x: x[(0,) * states.t.ndim], states))
    return _over_states(system, states, as_argument(function, system, first))


@jit
def _over_states(system, states, function):
    one = lambda state: function(with_changes(system, state), state)
    return (one if states.coordinates.ndim == 1 else jax.vmap(one))(states)


def _take_body(group, index, tree):
    return jax.tree.map(lambda x: x[index], (group.body, tree))


def _deformations(system, name, state):
    group, index = find_body(system, name)
    at = with_velocities(system, at_state(system, state, inertias=False), state.velocities)
    s = _take_body(group, index, elastic_state(system, group, at))[1]
    return s.q, s.flow[6:]


def body_motion(system, name, frame, state):
    """Motion of an elastic body; its inertia is the rate of the nodal momenta, `-(M y_dot + Omega x M y)`.

    Args: system: in force at the state.
    """
    group, index = find_body(system, name)
    at = with_velocities(system, at_state(system, state), state.velocities)
    a, *_ = accelerations(system, at)
    V_dot = node_accelerations(system.topology, at, a)
    body, s = _take_body(group, index, elastic_state(system, group, at))
    rate = flow_rate(body, s, *_take_body(group, index, interface_rates(system, group, V_dot, a))[1])
    component = frame.system

    def nodal_velocities(q, flow):
        """y (n,)."""
        carried = jnp.einsum("a,anm,m->n", flow[:3], rotated_shapes(component, frame.shapes), q)
        return frame.rigid @ flow[:6] + carried + frame.shapes @ flow[6:]

    y, y_dot = jax.jvp(nodal_velocities, (s.q, s.flow), (s.flow[6:], rate))
    spin, gravity = s.flow[:3], system.gravity @ s.R
    turning = jnp.einsum("a,anm->n", spin, rotated_shapes(component, (component.mass @ y)[:, None]))
    load = component.mass @ (frame.rigid[:, 3:] @ gravity - y_dot) - turning
    x, x_dot = frame.shapes @ body.elastic_deformations(s.q), frame.shapes @ s.flow[6:]
    wrench = inverse_dynamics_load(body, s, rate, gravity)[:6]
    return BodyMotion(s.q, x, x_dot, load, wrench, y, y_dot, spin, gravity)
