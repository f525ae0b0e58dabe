"""The inertia and gyristor fields of the paper in independent coordinates, and its state equations, term by term.

For analysis and for reading the bond graph; simulations use the tensor-free forms of `hamiltonian.py`.
"""

import jax
import jax.numpy as jnp
import numpy as np

from ..kinematics.influence import body_kic, velocity_map
from ..kinematics.influence_second import along_independent, body_kic_second
from ..kinematics.poses import coordinate_rate, frame_poses, geometry, node_parameters, node_poses
from ..math.spd import spd_solve
from ..model.question import check_fits, question
from ..model.system import System
from .elastic import refuse_elastic
from .ports import total_effort


def _arguments(system, state):
    refuse_elastic(system, "the paper's fields")
    return node_parameters(system), state.coordinates, state.t


def world_inertias(system: System, P, psi):
    """Inertia (bodies, 3, 3) of every body about its centre of mass, world axes."""
    R = frame_poses(system, node_poses(system.topology, P, psi))[0][np.arange(1, system.topology.bodies.size + 1)]
    return jnp.einsum("bij,bjk,blk->bil", R, system.inertia, R)


def _inertia_field(system, P, psi, t):
    G = body_kic(system, P, psi, t)
    G_r, G_t = G[:, :3], G[:, 3:]
    inertia = world_inertias(system, P, psi)
    return jnp.einsum("k,kci,kcj->ij", system.mass, G_t, G_t) + jnp.einsum("kci,kcd,kdj->ij", G_r, inertia, G_r)


@question
def inertia_field(system: System, state):
    """I* (N, N) = sum over bodies `m G_t^T G_t + G_r^T I G_r` (printed with one G_r in the mass term).

    Source: S2 (35); p = I* phi_dot, S2 (30), (34).
    """
    return _inertia_field(system, *_arguments(system, state))


@question
def gyristor_field(system: System, state):
    """GR (N, N) = sum over bodies `m Gt_dot^T G_t + Gr_dot^T I G_r`, along the motion.  Source: S2 (41)."""
    P, psi, t = _arguments(system, state)
    phi_dot = independent_rates(system, state)
    G, H = body_kic(system, P, psi, t), body_kic_second(system, P, psi, t)
    G_dot = jnp.einsum("bcnm,m->bcn", H, phi_dot)
    inertia = world_inertias(system, P, psi)
    translation = jnp.einsum("k,kci,kcj->ij", system.mass, G_dot[:, 3:], G[:, 3:])
    return translation + jnp.einsum("kci,kcd,kdj->ij", G_dot[:, :3], inertia, G[:, :3])


@question
def gyristor_field_direct(system: System, state):
    """GR~ (N, N), second form: row k is `1/2 phi_dot^T P*_k` with `P*_kij = dI*_ij/dphi_k` (print drops the 1/2).

    Its matrix differs from `gyristor_field`; the efforts agree, `GR phi_dot = GR~ phi_dot`.  For coordinates that
    are integrals of their velocities.  Source: S2 (47)-(54), (55).
    """
    P, psi, t = _arguments(system, state)
    planes = along_independent(system, P, psi, t, lambda q: _inertia_field(system, P, q, t))
    return 0.5 * jnp.einsum("i,ijk->kj", independent_rates(system, state), planes)


def independent_rates(system: System, state):
    """phi_dot (N,): velocities of the independent columns."""
    check_fits(system, state)
    chosen = (
        np.arange(system.topology.num_velocities)
        if system.topology.analysis is None
        else np.asarray(system.topology.analysis.independent, int)
    )
    return state.velocities[chosen]


@question
def generalised_momentum(system: System, state):
    """p (N,) = sum over bodies `G_t^T m v + G_r^T I omega` of the total velocities.  Source: S2 (30)-(34)."""
    P, psi, t = _arguments(system, state)
    G = body_kic(system, P, psi, t)
    b = velocity_map(system, P, psi, t)[1]
    unconstrained = jax.jvp(
        lambda q: _com_and_axes(system, P, q), (psi,), (coordinate_rate(system.topology, psi, b),)
    )[1]
    V = jnp.einsum("bcn,n->bc", G, independent_rates(system, state)) + unconstrained_twist(
        system, P, psi, unconstrained
    )
    momentum = jnp.concatenate(
        [jnp.einsum("bcd,bd->bc", world_inertias(system, P, psi), V[:, :3]), system.mass[:, None] * V[:, 3:]], axis=1
    )
    return jnp.einsum("bcn,bc->n", G, momentum)


def _com_and_axes(system, P, psi):
    geo, index = geometry(system, P, psi), np.arange(1, system.topology.bodies.size + 1)
    return geo.R[index], geo.x[index] + jnp.einsum("bij,bj->bi", geo.R[index], system.com)


def unconstrained_twist(system, P, psi, rates):
    """(bodies, 6) angular velocity and velocity of the centre of mass from rates of axes and centre."""
    R_dot, velocity = rates
    R, _ = _com_and_axes(system, P, psi)
    spin = jnp.einsum("bij,bkj->bik", R_dot, R)
    omega = 0.5 * jnp.stack(
        [spin[:, 2, 1] - spin[:, 1, 2], spin[:, 0, 2] - spin[:, 2, 0], spin[:, 1, 0] - spin[:, 0, 1]], 1
    )
    return jnp.concatenate([omega, velocity], axis=1)


@question
def state_equations(system: System, state):
    """(p_dot, phi_dot, q_dot) of the paper at a state of a scleronomic system.

    `p_dot = +GR phi_dot + Q` (the print has a minus), `phi_dot = I*^-1 p`, `q_dot = Gi phi_dot`.
    Source: S2 (42)-(44).
    """
    P, psi, t = _arguments(system, state)
    p = _inertia_field(system, P, psi, t) @ independent_rates(system, state)
    phi_dot = spd_solve(_inertia_field(system, P, psi, t), p)
    p_dot = gyristor_field(system, state) @ phi_dot + total_effort(system, state)
    Gamma = velocity_map(system, P, psi, t)[0]
    dependent = np.setdiff1d(
        np.arange(system.topology.num_velocities), np.asarray(system.topology.analysis.independent)
    )
    return p_dot, phi_dot, Gamma[dependent] @ phi_dot
