"""Newton-Euler on the tree: accelerations to efforts and back, O(nodes) for trees.

Source: S2 (28)-(29) body by body, `h_dot = wrench` about the world origin.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..kinematics import constraints
from ..kinematics.configuration import Moving, at_state, moving, node_accelerations
from ..kinematics.elastic import mass_matrix as inertia_matrix
from ..kinematics.state import State
from ..kinematics.tree import solve, subtrees
from ..math.linalg import saddle_solve
from ..math.spatial import add, cross_force, dot, momentum, pack, unpack
from ..model.question import question
from ..model.system import System
from ..typing import ArrayLike
from .efforts import efforts, gravity_wrench
from .elastic import needed_loads
from .sparse_saddle import constraint_rows, sparse_saddle


def momentum_rates(J, V, V_dot):
    """h_dot (nodes, 6) = J V_dot + V x* J V."""
    j, v = unpack(J), unpack(V)
    return pack(add(momentum(j, unpack(V_dot)), cross_force(v, momentum(j, v))))


def required_efforts(system: System, at: Moving, V_dot, u_dot, loads):
    """Efforts (nv,) that the tree needs at twist rates V_dot and accelerations u_dot beside gravity and the loads of
    its force elements, on nodes (nodes, 6) and columns (nv,)."""
    F, Q = loads
    load = momentum_rates(at.J, at.V, V_dot) - F - gravity_wrench(at.J, system.gravity)
    if system.elastic:
        needed = needed_loads(system, at, V_dot, u_dot)
        load, Q = load + needed.wrench, Q - needed.column
    return dot(unpack(at.S), unpack(subtrees(system.topology.nodes, load))) - Q


def accelerations(system: System, at: Moving, method="dense", loads=None, directions=None):
    """(u_dot (nv,), multipliers (rows,), gaps (rows,)): `M u_dot + bias - Q = A^T lambda`, `A u_dot - gamma` = gaps.

    Args:
        method: "dense" in the tree's velocities, or "block-sparse" on the graph of bodies.
        loads, directions: of the force elements on nodes and columns; `constraints.moving_directions`; where at hand.
    """
    none = jnp.zeros_like(at.u)
    V_dot = node_accelerations(system.topology, at, none)
    loads = efforts(system, at)[:2] if loads is None else loads
    need = -required_efforts(system, at, V_dot, none, loads)
    if not system.has_constraints and not system.elastic:
        return solve(system.topology.nodes, at.S, at.J, need), *jnp.zeros((2, 0), at.psi.dtype)
    known, _ = directions = directions or constraints.moving_directions(system, at)
    gamma = constraints.acceleration_bias(system, at, V_dot, directions)
    if method == "block-sparse":
        rows = constraint_rows(system, at, known)
        a, y = sparse_saddle(system, at, rows, need, gamma)
        return a, -y, rows.rates(a) / rows.unit - gamma
    A = constraints.jacobian(system, at, known)
    a, y = saddle_solve(inertia_matrix(system, at), A, need, gamma, constraints.row_scale(system))
    return a, -y, A @ a - gamma


def _at(system, state):
    return moving(system, at_state(system, state), state.velocities)


@question
def forward_dynamics(system: System, state: State) -> tuple[Float[Array, " nv"], Float[Array, " rows"]]:
    """Accelerations and constraint multipliers of a state.

    Returns: u_dot (nv,) [m/s^2 or rad/s^2] and lambda (rows,), the efforts along the constraint rows: `A^T lambda`
    acts on the velocities.  Redundant rows share their load (see `reactions` for the least-norm choice).
    Source: S2 (28)-(29), (40) solved for accelerations.
    """
    return accelerations(system, _at(system, state))[:2]


@question
def inverse_dynamics(system: System, state: State, acceleration: ArrayLike) -> Float[Array, " nv"]:
    """Efforts (nv,) on the tree's velocities that produce the accelerations (nv,), beside gravity and all force
    elements; constraint multipliers are not subtracted.  Source: S2 (40)."""
    at = _at(system, state)
    V_dot = node_accelerations(system.topology, at, acceleration)
    return required_efforts(system, at, V_dot, acceleration, efforts(system, at)[:2])


@question
def mass_matrix(system: System, state: State) -> Float[Array, "nv nv"]:
    """Mass matrix (nv, nv) of the tree of rigid and elastic bodies, all loops cut.

    Source: S2 (35) with every coordinate independent.
    """
    return inertia_matrix(system, at_state(system, state))
