"""Newton-Euler on the tree: accelerations to efforts and back, O(nodes) for trees.

Source: S2 (28)-(29) body by body, `h_dot = wrench` about the world origin.
"""

import jax.numpy as jnp

from ..kinematics import constraints
from ..kinematics.elastic import mass_matrix as inertia_matrix
from ..kinematics.poses import geometry, node_inertias, node_parameters
from ..kinematics.tree import ancestors, solve, subtrees
from ..math.linalg import saddle_solve
from ..math.spatial import add, cross_force, cross_motion, dot, momentum, pack, scale, unpack
from ..model.question import question
from ..model.system import System
from .efforts import efforts, gravity_wrench
from .elastic import needed_loads
from .sparse_saddle import constraint_rows, sparse_saddle


def column_twists(topology, V):
    """Twist of the node whose frame carries each column (a ball's three columns turn with its child)."""
    return V if topology.is_simple else V[topology.column_frame]


def node_motion(topology, S, u):
    """World twists (nodes, 6, ...) of all nodes at velocities u (nv, ...)."""
    return ancestors(topology.nodes, pack(scale(unpack(S), u)))


def node_accelerations(topology, S, V, u, a):
    """World twist rates (nodes, 6) at velocities u and accelerations a (nv,): ancestor sum of `S a + S_dot u`."""
    s, v = unpack(S), unpack(column_twists(topology, V))
    return ancestors(topology.nodes, pack(add(scale(s, a), scale(cross_motion(v, s), u))))


def momentum_rates(J, V, V_dot):
    """h_dot (nodes, 6) = J V_dot + V x* J V."""
    j, v = unpack(J), unpack(V)
    return pack(add(momentum(j, unpack(V_dot)), cross_force(v, momentum(j, v))))


def required_efforts(system: System, geo, J, V, V_dot, psi, u, u_dot, loads):
    """Efforts (nv,) that the tree needs at twist rates V_dot and accelerations u_dot beside gravity and the loads of
    its force elements, on nodes (nodes, 6) and columns (nv,)."""
    F, Q = loads
    load = momentum_rates(J, V, V_dot) - F - gravity_wrench(J, system.gravity)
    if system.elastic:
        needed = needed_loads(system, geo, psi, V, u, V_dot, u_dot)
        load, Q = load + needed.wrench, Q - needed.column
    return dot(unpack(geo.S), unpack(subtrees(system.topology.nodes, load))) - Q


def tree_efforts(system: System, P, psi, u, a, t):
    """Efforts (nv,) that the tree needs at accelerations a beside gravity and force elements, `M a + bias - Q`."""
    geo = geometry(system, P, psi)
    V = node_motion(system.topology, geo.S, u)
    V_dot = node_accelerations(system.topology, geo.S, V, u, a)
    loads = efforts(system, geo, V, psi, u, t)[:2]
    return required_efforts(system, geo, node_inertias(P, geo.W), V, V_dot, psi, u, a, loads)


def accelerations_at(system: System, geo, J, V, psi, u, t, method="dense"):
    """(u_dot (nv,), multipliers (rows,)); see `solved_accelerations`."""
    return solved_accelerations(system, geo, J, V, psi, u, t, method)[:2]


def solved_accelerations(system: System, geo, J, V, psi, u, t, method="dense", loads=None, moving=None):
    """(u_dot (nv,), multipliers (rows,), gaps (rows,)): `M u_dot + bias - Q = A^T lambda`, `A u_dot - gamma` = gaps.

    Args:
        method: "dense" in the tree's velocities, or "block-sparse" on the graph of bodies.
        loads, moving: of the force elements on nodes and columns; `constraints.moving_directions`; where at hand.
    """
    none = jnp.zeros_like(u)
    V_dot = node_accelerations(system.topology, geo.S, V, u, none)
    loads = efforts(system, geo, V, psi, u, t)[:2] if loads is None else loads
    need = -required_efforts(system, geo, J, V, V_dot, psi, u, none, loads)
    if not system.has_constraints and not system.elastic:
        return solve(system.topology.nodes, geo.S, J, need), *jnp.zeros((2, 0), psi.dtype)
    known, _ = moving = moving or constraints.moving_directions(system, geo)
    gamma = constraints.acceleration_bias(system, geo, V, V_dot, psi, u, t, moving)
    if method == "block-sparse":
        rows = constraint_rows(system, geo, psi, t, known)
        a, y = sparse_saddle(system, geo, J, psi, rows, need, gamma)
        return a, -y, rows.rates(a) / rows.unit - gamma
    A = constraints.jacobian_at(system, geo, psi, t, known)
    a, y = saddle_solve(inertia_matrix(system, geo, J, psi), A, need, gamma, constraints.row_scale(system))
    return a, -y, A @ a - gamma


def accelerations(system: System, P, psi, u, t):
    """(u_dot, multipliers) from the tree parameters P; see `accelerations_at`."""
    geo = geometry(system, P, psi)
    V = node_motion(system.topology, geo.S, u)
    return accelerations_at(system, geo, node_inertias(P, geo.W), V, psi, u, t)


@question
def forward_dynamics(system: System, state):
    """Accelerations and constraint multipliers of a state.

    Returns: u_dot (nv,) [m/s^2 or rad/s^2] and lambda (rows,), the efforts along the constraint rows: `A^T lambda`
    acts on the velocities.  Redundant rows share their load (see `reactions` for the least-norm choice).
    Source: S2 (28)-(29), (40) solved for accelerations.
    """
    P = node_parameters(system)
    return accelerations(system, P, state.coordinates, state.velocities, state.t)


@question
def inverse_dynamics(system: System, state, acceleration):
    """Efforts (nv,) on the tree's velocities that produce the accelerations (nv,), beside gravity and all force
    elements; constraint multipliers are not subtracted.  Source: S2 (40)."""
    P = node_parameters(system)
    return tree_efforts(system, P, state.coordinates, state.velocities, acceleration, state.t)


@question
def mass_matrix(system: System, state):
    """Mass matrix (nv, nv) of the tree of rigid and elastic bodies, all loops cut.

    Source: S2 (35) with every coordinate independent.
    """
    P = node_parameters(system)
    geo = geometry(system, P, state.coordinates)
    return inertia_matrix(system, geo, node_inertias(P, geo.W), state.coordinates)
