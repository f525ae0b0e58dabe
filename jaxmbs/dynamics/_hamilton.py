"""Hamilton's equations of the tree and of constrained systems: state (coordinates, momenta).

Trees carry (psi, p) with `p = M u`.  Systems with constraint rows carry the canonical momentum of Bayo and Avello,
`[M A^T; A 0][u; sigma] = [P; -f_t]`, which needs no independent set and passes singular poses; every set of
independent coordinates sees the paper's p as `Gamma^T P` because `Gamma^T A^T = 0`.
"""

import jax
import jax.numpy as jnp

from ..constraints import _closures as closures
from ..constraints import _constraints as constraints
from ..constraints._frontal_saddle import MOTION_COMPLIANCE
from ..constraints._kic import velocity_map
from ..constraints._linear_solver import linear_solver
from ..constraints._saddle_operator import constraint_operator
from ..kinematics._configuration import (
    Configuration,
    VelocityKinematics,
    column_twists,
    configuration,
    with_velocities,
)
from ..kinematics._elastic import mass_matrix
from ..kinematics._poses import coordinate_rate
from ..kinematics._tree import solve, subtrees
from ..math._linalg import saddle_solve
from ..math._spatial import cross_motion, dot
from ..math._spd import spd_solve
from ..model._system import System
from ..model._topology import Topology
from ..signal_flow._signals import with_signals
from ._bodies import body_momenta, inertial_loads
from ._loads import Loads, on_columns
from ._newton_euler import all_efforts
from ._saddle import saddle_without_matrix


def momentum_rate(topology: Topology, S, V, h, F):
    """First gyristor form (nodes, ...): `h . S_dot + S . F` with momenta h, wrenches F (nodes, 6, ...) of subtrees.

    Equals `GR phi_dot + Q` of S2 (42) without forming a tensor, O(nodes); columns fixed in the child, so it holds
    for quaternion velocities too.  Source: S2 (38)-(42).
    """
    total = subtrees(topology.nodes, jnp.concatenate([h, F], axis=1))
    return dot(total[:, :6], cross_motion(column_twists(topology, V), S)) + dot(total[:, 6:], S)


def tree_momentum_rate(system: System, at: VelocityKinematics, sigma=None):
    """Momentum rate (nv,) under gravity, force elements and `A_dot^T sigma`, and the elements' powers.

    Args: at: `closures.with_directions`, with sigma.

    The wrenches that sigma puts on the tree join the momenta, their rates join the loads: one subtree sum for all.
    """
    F, Q, powers = all_efforts(system, at)
    h, loads = body_momenta(system, at).wrench, Loads(F, Q) + inertial_loads(system, at)
    if sigma is not None:
        wrenches, rates, part = constraints.constraint_momentum_rate(system, at, sigma)
        h, loads = h + wrenches, loads + Loads(rates, part)
    return momentum_rate(system.topology, at.S, at.V, h, loads.wrench) + loads.column, powers


def velocities(system: System, at: Configuration, p):
    """Velocities u (nv,) of the state (psi, p) and the multipliers sigma (rows,) of the momentum."""
    if system.is_rigid_tree:
        return solve(system.topology.nodes, at.S, at.J, p), None
    f_t = constraints.time_rate(system, at)
    method = linear_solver(system)
    if method != "dense":
        rows = constraint_operator(system, at)
        return saddle_without_matrix(method, system, at, rows, p, -f_t, compliance=MOTION_COMPLIANCE)
    A, M = constraints.jacobian(system, at), mass_matrix(system, at)
    return saddle_solve(M, A, p, -f_t, constraints.row_scale(system))


def momenta(system: System, at: VelocityKinematics):
    """Momenta p = M u (nv,); Source: S2 (30), (34)."""
    return on_columns(system, at, body_momenta(system, at))


def canonical_rate(system: System, at: Configuration, p):
    """Canonical rates (psi_dot, p_dot, powers) of the state (psi, p) of a tree or a constrained system, and the
    configuration with its velocities and signals.

    `p_dot = Q + sum J_dot^T h + A_dot^T sigma`.  The derivation uses only `V = J u` and the conservation of power, so
    it holds for quasi-velocities (balls) and for rows of velocity alone (rolling) as it stands: the Hamel terms of
    Lagrange's equations would come from commuting derivatives of coordinates, and none are taken.

    Source: S2 (42)-(44) in all velocities.
    """
    at = closures.with_directions(system, at)
    u, sigma = velocities(system, at, p)
    here = with_signals(system, with_velocities(system, at, u))
    rate, powers = tree_momentum_rate(system, here, sigma)
    return coordinate_rate(system.topology, at.psi, u), rate, powers, here


def independent_velocities(system: System, at: Configuration, p):
    """Velocities u (nv,) of the paper's momenta p (N,) at fixed independent coordinates.

    `u = Gamma phi_dot + b`, `phi_dot = I*^-1 (p - c)`, `c = Gamma^T M b`; Source: S2 (43)-(44).
    """
    Gamma, b = velocity_map(system, at)
    M = mass_matrix(system, at)
    I_star = Gamma.T @ M @ Gamma
    phi_dot = spd_solve(I_star, p - Gamma.T @ (M @ b))
    return Gamma @ phi_dot + b


def independent_rate(system: System, at: Configuration, p):
    """Rates (psi_dot, p_dot, powers) in independent coordinates, and the configuration with its velocities and
    signals.  Source: S2 (42)-(44).

    `p_dot = Gamma^T (Q + sum J_dot^T h) + Gamma_dot^T M u`: singular where the independent set is.
    """
    u = independent_velocities(system, at, p)
    here = with_signals(system, with_velocities(system, at, u))
    rate, powers = tree_momentum_rate(system, here)
    h, psi_dot = momenta(system, here), coordinate_rate(system.topology, at.psi, u)

    def carried(psi, t):
        return velocity_map(system, configuration(system, at.P, psi, t, inertias=False))[0].T @ h

    _, turning = jax.jvp(carried, (at.psi, at.t), (psi_dot, jnp.ones_like(at.t)))
    return psi_dot, velocity_map(system, at)[0].T @ rate + turning, powers, here
