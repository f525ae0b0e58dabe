"""Hamilton's equations of the tree and of constrained systems: state (coordinates, momenta).

Trees carry (psi, p) with `p = M u`.  Systems with constraint rows carry the canonical momentum of Bayo and Avello,
`[M A^T; A 0][u; sigma] = [P; -f_t]`, which needs no independent set and passes singular poses; every set of
independent coordinates sees the paper's p as `Gamma^T P` because `Gamma^T A^T = 0`.
"""

import jax
import jax.numpy as jnp

from ..kinematics import constraints
from ..kinematics.elastic import mass_matrix
from ..kinematics.influence import velocity_map
from ..kinematics.poses import (
    coordinate_rate,
    first_place,
    geometry,
    joint_twists,
    node_inertias,
    node_poses,
    referred,
)
from ..kinematics.tree import solve, subtrees
from ..math.linalg import saddle_solve
from ..math.spatial import cross_motion, dot, momentum, pack, unpack
from ..math.spd import spd_solve
from ..model.system import System
from ..model.topology import Topology
from .efforts import efforts, gravity_wrench
from .elastic import elastic_momenta, inertial_loads
from .newton_euler import column_twists, node_motion


def momentum_rate(topology: Topology, S, V, h, F):
    """First gyristor form (nodes, ...): `h . S_dot + S . F` with momenta h, wrenches F (nodes, 6, ...) of subtrees.

    Equals `GR phi_dot + Q` of S2 (42) without forming a tensor, O(nodes); columns fixed in the child, so it holds
    for quaternion velocities too.  Source: S2 (38)-(42).
    """
    s, v = unpack(S), unpack(column_twists(topology, V))
    total = unpack(subtrees(topology.nodes, jnp.concatenate([h, F], axis=1)))
    return dot(total[:6], cross_motion(v, s)) + dot(total[6:], s)


def tree_state_rate(topology: Topology, P, psi, p, gravity):
    """(psi_dot, p_dot) of a tree under gravity alone; parameters and states may carry batch axes, last.

    Args: P (nodes, 23[, batch]) of `node_parameters`, psi, p (nodes[, batch]); simple joints only.
    Source: S2 (42)-(43).
    """
    W = node_poses(topology, P, psi)
    W = referred(W, first_place(topology, W))
    S, J = joint_twists(topology, P, W), node_inertias(P, W)
    u = solve(topology.nodes, S, J, p)
    V = node_motion(topology, S, u)
    h = pack(momentum(unpack(J), unpack(V)))
    return u, momentum_rate(topology, S, V, h, gravity_wrench(J, gravity))


def tree_momentum_rate(system: System, geo, J, V, psi, u, t, sigma=None, moving=None):
    """Momentum rate (nv,) under gravity, force elements and `A_dot^T sigma`, and the elements' powers.

    Args: moving: `constraints.moving_directions`, with sigma.

    The wrenches that sigma puts on the tree join the momenta, their rates join the loads: one subtree sum for all.
    """
    F, Q, powers = efforts(system, geo, V, psi, u, t)
    h, F = pack(momentum(unpack(J), unpack(V))), F + gravity_wrench(J, system.gravity)
    if sigma is not None:
        wrenches, rates, part = constraints.pull(system, geo, V, psi, u, t, sigma, moving)
        h, F, Q = h + wrenches, F + rates, Q + part
    if system.elastic:
        loads = inertial_loads(system, geo, psi, V, u)
        h = h + elastic_momenta(system, geo, psi, V, u).wrench
        F, Q = F + loads.wrench, Q + loads.column
    return momentum_rate(system.topology, geo.S, V, h, F) + Q, powers


def velocities_at(system: System, geo, J, psi, p, t, known=None):
    """Velocities u (nv,) of the state (psi, p) and the multipliers sigma (rows,) of the momentum; known:
    `constraints.directions`."""
    if not system.has_constraints and not system.elastic:
        return solve(system.topology.nodes, geo.S, J, p), None
    A = constraints.jacobian_at(system, geo, psi, t, known)
    M, f_t = mass_matrix(system, geo, J, psi), constraints.time_rate(system, psi, t)
    return saddle_solve(M, A, p, -f_t, constraints.row_scale(system))


def momenta_at(system: System, geo, J, psi, u):
    """Momenta p = M u (nv,); Source: S2 (30), (34)."""
    V = node_motion(system.topology, geo.S, u)
    h = pack(momentum(unpack(J), unpack(V)))
    modal = jnp.zeros_like(u)
    if system.elastic:
        wrench, modal = elastic_momenta(system, geo, psi, V, u)
        h = h + wrench
    return dot(unpack(geo.S), unpack(subtrees(system.topology.nodes, h))) + modal


def velocities(system: System, P, psi, p, t):
    """Velocities u (nv,) of the state (psi, p); see `velocities_at`."""
    geo = geometry(system, P, psi)
    return velocities_at(system, geo, node_inertias(P, geo.W), psi, p, t)[0]


def momenta(system: System, P, psi, u):
    """Momenta p = M u (nv,); see `momenta_at`."""
    geo = geometry(system, P, psi)
    return momenta_at(system, geo, node_inertias(P, geo.W), psi, u)


def canonical_rate(system: System, P, t, psi, p):
    """(psi_dot, p_dot, powers, u) of the state (psi, p), trees and constrained systems alike.

    `p_dot = Q + sum J_dot^T h + A_dot^T sigma`.  The derivation uses only `V = J u` and the conservation of power, so
    it holds for quasi-velocities (balls) and for rows of velocity alone (rolling) as it stands: the Hamel terms of
    Lagrange's equations would come from commuting derivatives of coordinates, and none are taken.

    Source: S2 (42)-(44) in all velocities.
    """
    geo = geometry(system, P, psi)
    J = node_inertias(P, geo.W)
    moving = constraints.moving_directions(system, geo)
    u, sigma = velocities_at(system, geo, J, psi, p, t, moving[0])
    V = node_motion(system.topology, geo.S, u)
    rate, powers = tree_momentum_rate(system, geo, J, V, psi, u, t, sigma, moving)
    return coordinate_rate(system.topology, psi, u), rate, powers, u


def independent_velocities(system: System, P, psi, p, t):
    """Velocities u (nv,) of the paper's momenta p (N,) at fixed independent coordinates.

    `u = Gamma phi_dot + b`, `phi_dot = I*^-1 (p - c)`, `c = Gamma^T M b`; Source: S2 (43)-(44).
    """
    Gamma, b = velocity_map(system, P, psi, t)
    M = tree_mass(system, P, psi)
    I_star = Gamma.T @ M @ Gamma
    phi_dot = spd_solve(I_star, p - Gamma.T @ (M @ b))
    return Gamma @ phi_dot + b


def independent_rate(system: System, P, t, psi, p):
    """(psi_dot, p_dot, powers, u) in the independent coordinates themselves; Source: S2 (42)-(44).

    `p_dot = Gamma^T (Q + sum J_dot^T h) + Gamma_dot^T M u`: singular where the independent set is.
    """
    u = independent_velocities(system, P, psi, p, t)
    geo = geometry(system, P, psi)
    J = node_inertias(P, geo.W)
    rate, powers = tree_momentum_rate(system, geo, J, node_motion(system.topology, geo.S, u), psi, u, t)
    h = momenta_at(system, geo, J, psi, u)
    psi_dot = coordinate_rate(system.topology, psi, u)
    Gamma = velocity_map(system, P, psi, t)[0]
    turning = jax.jvp(lambda psi, t: velocity_map(system, P, psi, t)[0].T @ h, (psi, t), (psi_dot, jnp.ones_like(t)))[
        1
    ]
    return psi_dot, Gamma.T @ rate + turning, powers, u


def element_powers(system: System, P, psi, u, t):
    """Power of every force element beside stored energy [W], in the order of `element_names`."""
    geo = geometry(system, P, psi)
    return efforts(system, geo, node_motion(system.topology, geo.S, u), psi, u, t)[2]


def tree_mass(system: System, P, psi):
    """Mass matrix (nv, nv) of the tree of rigid and elastic bodies."""
    geo = geometry(system, P, psi)
    return mass_matrix(system, geo, node_inertias(P, geo.W), psi)
