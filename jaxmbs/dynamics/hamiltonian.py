"""Hamilton's equations of the tree and of constrained systems: state (coordinates, momenta).

Trees carry (psi, p) with `p = M u`.  Systems with constraint rows carry the canonical momentum of Bayo and Avello,
`[M A^T; A 0][u; sigma] = [P; -f_t]`, which needs no independent set and passes singular poses; every set of
independent coordinates sees the paper's p as `Gamma^T P` because `Gamma^T A^T = 0`.
"""

import jax
import jax.numpy as jnp

from ..kinematics import constraints
from ..kinematics.kic import velocity_map
from ..kinematics.poses import coordinate_rate, joint_twists, node_inertias, node_poses
from ..kinematics.tree import mass_matrix, solve, subtrees
from ..math.linalg import saddle_solve
from ..math.spatial import cross_motion, dot, momentum, pack, unpack
from ..model.system import System
from ..model.topology import Topology
from .efforts import efforts, gravity_wrench
from .newton_euler import column_twists, node_motion


def momentum_rate(topology: Topology, S, J, V, F):
    """First gyristor form (nodes, ...): `h . S_dot + S . F` with h, F the subtree's momentum and wrench.

    Equals `GR phi_dot + Q` of S2 (42) without forming a tensor, O(nodes); columns fixed in the child, so it holds
    for quaternion velocities too.  Source: S2 (38)-(42).
    """
    s, v = unpack(S), unpack(column_twists(topology, V))
    h = pack(momentum(unpack(J), unpack(V)))
    total = unpack(subtrees(topology.nodes, jnp.concatenate([h, F], axis=1)))
    return dot(total[:6], cross_motion(v, s)) + dot(total[6:], s)


def tree_state_rate(topology: Topology, P, psi, p, gravity):
    """(psi_dot, p_dot) of a tree under gravity alone; parameters and states may carry batch axes, last.

    Args: P (nodes, 23[, batch]) of `node_parameters`, psi, p (nodes[, batch]); simple joints only.
    Source: S2 (42)-(43).
    """
    W = node_poses(topology, P, psi)
    S, J = joint_twists(topology, P, W), node_inertias(P, W)
    u = solve(topology.nodes, S, J, p)
    V = node_motion(topology, S, u)
    return u, momentum_rate(topology, S, J, V, gravity_wrench(J, gravity))


def _geometry(system, P, psi):
    W = node_poses(system.topology, P, psi)
    return W, joint_twists(system.topology, P, W), node_inertias(P, W)


def tree_momentum_rate(system: System, W, S, J, psi, u, t):
    """Momentum rate (nv,) of the tree under gravity and all force elements, and the elements' powers."""
    V = node_motion(system.topology, S, u)
    F, Q, powers = efforts(system, W, V, psi, u, t)
    rate = momentum_rate(system.topology, S, J, V, F + gravity_wrench(J, system.gravity))
    return rate + Q, powers


def velocities(system: System, P, psi, p, t):
    """Velocities u (nv,) of the state (psi, p) and the multipliers sigma (rows,) of the momentum."""
    _, S, J = _geometry(system, P, psi)
    return _velocities(system, P, S, J, psi, p, t)


def _velocities(system, P, S, J, psi, p, t):
    nodes = system.topology.nodes
    if not system.has_constraints:
        return solve(nodes, S, J, p), jnp.zeros(0, p.dtype)
    A = constraints.jacobian(system, P, psi, t)
    return saddle_solve(
        mass_matrix(nodes, S, J), A, p, -constraints.time_rate(system, P, psi, t), constraints.row_scale(system)
    )


def momenta(system: System, P, psi, u):
    """Momenta p = M u (nv,); Source: S2 (30), (34)."""
    _, S, J = _geometry(system, P, psi)
    V = node_motion(system.topology, S, u)
    return dot(unpack(S), unpack(subtrees(system.topology.nodes, pack(momentum(unpack(J), unpack(V))))))


def canonical_rate(system: System, P, t, psi, p):
    """(psi_dot, p_dot, powers, u) of the state (psi, p), trees and constrained systems alike.

    `p_dot = Q + sum J_dot^T h + A_dot^T sigma`; Source: S2 (42)-(44) in all velocities.
    """
    W, S, J = _geometry(system, P, psi)
    u, sigma = _velocities(system, P, S, J, psi, p, t)
    psi_dot = coordinate_rate(system.topology, psi, u)
    rate, powers = tree_momentum_rate(system, W, S, J, psi, u, t)
    if system.has_constraints:
        pull = jax.jvp(
            lambda psi, t: constraints.jacobian(system, P, psi, t).T @ sigma, (psi, t), (psi_dot, jnp.ones_like(t))
        )[1]
        rate = rate + pull
    return psi_dot, rate, powers, u


def independent_velocities(system: System, P, psi, p, t):
    """Velocities u (nv,) of the paper's momenta p (N,) at fixed independent coordinates.

    `u = Gamma phi_dot + b`, `phi_dot = I*^-1 (p - c)`, `c = Gamma^T M b`; Source: S2 (43)-(44).
    """
    Gamma, b = velocity_map(system, P, psi, t)
    _, S, J = _geometry(system, P, psi)
    M = mass_matrix(system.topology.nodes, S, J)
    I_star = Gamma.T @ M @ Gamma
    phi_dot = jax.scipy.linalg.cho_solve(jax.scipy.linalg.cho_factor(I_star), p - Gamma.T @ (M @ b))
    return Gamma @ phi_dot + b


def independent_rate(system: System, P, t, psi, p):
    """(psi_dot, p_dot, powers, u) in the independent coordinates themselves; Source: S2 (42)-(44).

    `p_dot = Gamma^T (Q + sum J_dot^T h) + Gamma_dot^T M u`: singular where the independent set is.
    """
    u = independent_velocities(system, P, psi, p, t)
    W, S, J = _geometry(system, P, psi)
    rate, powers = tree_momentum_rate(system, W, S, J, psi, u, t)
    h = momenta(system, P, psi, u)
    psi_dot = coordinate_rate(system.topology, psi, u)
    Gamma = velocity_map(system, P, psi, t)[0]
    turning = jax.jvp(lambda psi, t: velocity_map(system, P, psi, t)[0].T @ h, (psi, t), (psi_dot, jnp.ones_like(t)))[
        1
    ]
    return psi_dot, Gamma.T @ rate + turning, powers, u


def element_powers(system: System, P, psi, u, t):
    """Power of every force element beside stored energy [W], in the order of `element_names`."""
    W, S, _ = _geometry(system, P, psi)
    return efforts(system, W, node_motion(system.topology, S, u), psi, u, t)[2]


def tree_mass(system: System, P, psi):
    """Mass matrix (nv, nv) of the tree."""
    _, S, J = _geometry(system, P, psi)
    return mass_matrix(system.topology.nodes, S, J)
