"""Loads of a mechanism's motion on finite-element models of its rigid bodies, for stress analyses."""

from collections.abc import Mapping

import jax.numpy as jnp

from ..assembly._state import HasStates, State
from ..checks import no_such
from ..constraints import _reaction_map as reaction_map
from ..dynamics._newton_euler import accelerations
from ..elements import DIRECTIONS
from ..errors import ModelError
from ..kinematics._configuration import at_state, node_accelerations, with_velocities
from ..linear._system import LinearSystem
from ..math._linalg import skew
from ..model._changes import with_changes
from ..model._entry_points import states_of
from ..model._system import System
from ..reaction._solve import reactions
from ..runtime import jit, map_chunked
from ..typing import Matrix3, Scalar, Vector3
from ._rigid_motions import rigid_basis, row_directions


def carried_loads(
    system: System,
    motion: State | HasStates,
    components: Mapping,
    joints: Mapping | None = None,
    method: str = "dense",
) -> dict:
    """Loads on components that move rigidly with a body: weight, inertia, and joint reactions.

    Args:
        motion: a State, a Motion, or a State with one leading axis.
        components: frame or body name -> LinearSystem with positions, in that frame's axes and from its origin.
        joints: joint name -> (frame, node): the reaction of the joint acts on that node of the component of the
            frame. If all joints of a body are given and no other forces act on it, its loads are in balance.
        method: solution method of the reactions, as in `reactions`.

    Returns: frame -> loads (..., n) [N, N m] on the component's coordinates, in the frame's axes.  Directions for
    which a node has no coordinate take none: for a joint on a solid, give its node six coordinates by `rigid_node`.
    Inertia is that of the component's own mass matrix, its resultants exact.

    Raises: ModelError for unknown names, a joint that the frame's body does not have, no positions, or a frame of an
    elastic body, whose modes already carry its loads (`FloatingFrame`); all in one.
    Source: S1 (3), (18); S2 (28)-(29).
    """
    joints = {} if joints is None else dict(joints)
    states = states_of(system, motion)
    _check(system, components, joints)
    found = reactions(system, states, method=method) if joints else None
    wrenches = {} if found is None else {name: (found[name].force, found[name].moment) for name in joints}
    return _component_loads(system, states, dict(components), wrenches, tuple(joints.items()), method)


def mass_properties(component: LinearSystem) -> tuple[Scalar, Vector3, Matrix3]:
    """Mass () [kg], centre of mass (3,) [m] and inertia about it (3, 3) [kg m^2] of a free component.

    They are arguments of `SystemBuilder.body`.

    Raises: ModelError for a component without the positions of its nodes.  Source: S1 (3).
    """
    if component.positions is None:
        raise ModelError(["`mass_properties` needs the positions of the nodes: LinearSystem(..., positions=...)"])
    B = rigid_basis(component, jnp.zeros(3, component.positions.dtype))
    J = B.T @ component.mass @ B
    mass = jnp.trace(J[3:, 3:]) / 3.0
    lever = (J[:3, 3:] - J[3:, :3]) / (2.0 * mass)  # skew(centre)
    centre = jnp.stack([lever[2, 1], lever[0, 2], lever[1, 0]])
    inertia = J[:3, :3] + mass * skew(centre) @ skew(centre)
    return mass, centre, 0.5 * (inertia + inertia.T)


def _check(system, components, joints):
    top, faults = system.topology, []
    names = {name: ends for name, *ends in reaction_map.reaction_carriers(system)}
    elastic = {top.frame_body[frame] for group in system.elastic for frames in group.frames for frame in frames}
    for frame, component in components.items():
        if frame not in top.frame_index:
            faults.append(f"components: {no_such('body or frame', frame, top.frame_names)}")
        elif top.frame_body[top.frame_index[frame]] in elastic:
            faults.append(f"components: {frame!r} is on an elastic body, whose loads are those of its own modes")
        if component.positions is None:
            faults.append(f"component {frame!r}: needs the positions of its nodes, LinearSystem(..., positions=...)")
    for name, (frame, node) in joints.items():
        if frame not in components:
            faults.append(f"joint {name!r}: no component is given for frame {frame!r}")
        elif node not in components[frame].nodes:
            faults.append(f"joint {name!r}: {no_such('node of its component', node, components[frame].nodes)}")
        if name not in names:
            faults.append(no_such("joint", name, names))
        elif frame in top.frame_index and _joint_side(top, names[name], frame) == 0.0:
            faults.append(f"joint {name!r} is not on the body of {frame!r}")
    if faults:
        raise ModelError(faults)


def _joint_side(top, ends, frame):
    """Sign of a joint's reaction on the frame's body: 1 on its child, -1 on its parent, 0 on neither."""
    parent, child = (top.frame_body[end] for end in ends)
    body = top.frame_body[top.frame_index[frame]]
    return 1.0 if body == child else -1.0 if body == parent else 0.0


@jit
def _component_loads(system, states, components, wrenches, joints, method):
    def loads(row):
        state, wrenches = row
        here = with_changes(system, state)
        at, V, V_dot = _node_motion(here, state, method)
        found = {frame: _inertia_load(here, at, V, V_dot, frame, c) for frame, c in components.items()}
        for name, (frame, node) in joints:
            found[frame] = found[frame] + _joint_load(here, at, wrenches[name], name, frame, components[frame], node)
        return found

    rows = states, wrenches
    return loads(rows) if states.coordinates.ndim == 1 else map_chunked(loads, rows)


def _node_motion(system, state, method):
    """Configuration, and world twists of all nodes and their rates (nodes + 1, 6), those of the ground last."""
    at = with_velocities(system, at_state(system, state), state.velocities)
    V_dot = node_accelerations(system.topology, at, accelerations(system, at, method)[0])
    return at, *(jnp.concatenate([v, jnp.zeros((1, 6), v.dtype)]) for v in (at.V, V_dot))


def _inertia_load(system, at, V, V_dot, frame, component):
    """Weight minus the rate of the nodal momenta `h = M y`, y = (v, omega) of every node in the frame's axes:
    `p' + omega x p` in translations, `l' + omega x l + v x p` in rotations."""
    top = system.topology
    index = top.frame_index[frame]
    R, x, node = at.R[index], at.x[index], top.frame_node[index]
    B, M = rigid_basis(component, jnp.zeros(3, x.dtype)), component.mass

    def in_frame(twist):
        """(rotation, translation of the frame's origin) (6,) in the frame's axes."""
        omega, v = twist[:3], twist[3:] + jnp.cross(twist[:3], x)
        return jnp.concatenate([R.T @ omega, R.T @ v])

    flow, flow_dot = in_frame(V[node]), in_frame(V_dot[node])
    omega, weight = flow[:3], B[:, 3:] @ (R.T @ system.gravity)
    y = B @ flow
    v, (p, l) = _split_vectors(component, y)[0], _split_vectors(component, M @ y)
    spin = jnp.broadcast_to(omega, p.shape)
    turning = _join_vectors(component, jnp.cross(spin, p), jnp.cross(spin, l) + jnp.cross(v, p))
    return M @ (weight - B @ flow_dot) - turning


def _joint_load(system, where, wrench, name, frame, component, node):
    """Load (n,) of a joint's reaction on one node: its force, and its moment about the node."""
    top = system.topology
    ends = next(ends for other, *ends in reaction_map.reaction_carriers(system) if other == name)
    index, sign = top.frame_index[frame], _joint_side(top, ends, frame)
    R, place = where.R[index], component.positions[component.nodes.index(node)]
    force, moment = (sign * R.T @ w for w in wrench)
    moment = moment + jnp.cross(R.T @ (where.x[ends[1]] - where.x[index]) - place, force)
    at = jnp.asarray([other == node for other in component.nodes], force.dtype)
    return _join_vectors(component, jnp.outer(at, force), jnp.outer(at, moment))


def _split_vectors(component, y):
    """Vectors (nodes, 3) along and about the axes of the nodes, from coordinates (n,)."""
    node, direction = row_directions(component)
    real = direction >= 0
    u = jnp.zeros((len(component.nodes), len(DIRECTIONS)), y.dtype).at[node[real], direction[real]].set(y[real])
    return u[:, :3], u[:, 3:]


def _join_vectors(component, along, about):
    """Coordinates (n,) from vectors (nodes, 3) along and about the axes of the nodes."""
    node, direction = row_directions(component)
    both = jnp.concatenate([along, about], axis=1)
    return jnp.where(direction >= 0, both[node, direction], 0.0)
