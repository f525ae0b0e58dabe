"""The inertia and gyristor fields of the paper in independent coordinates, and its state equations, term by term.

For analysis and for reading the bond graph; simulations use the tensor-free forms of `hamiltonian.py`.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..kinematics.configuration import Configuration, at_state, elsewhere
from ..kinematics.influence import body_kic, dependent_columns, independent_columns, velocity_map
from ..kinematics.influence_second import along_independent, body_kic_second
from ..kinematics.poses import body_frame, coordinate_rate
from ..kinematics.state import State
from ..math.spd import spd_solve
from ..model.question import check_fits, question
from ..model.system import System
from .elastic import refuse_elastic
from .ports import total_effort


def _at(system, state):
    refuse_elastic(system, "the paper's fields")
    return at_state(system, state, inertias=False)


def world_inertias(system: System, at: Configuration):
    """Inertia (bodies, 3, 3) of every body about its centre of mass, world axes."""
    R = at.R[body_frame(system.topology)]
    return jnp.einsum("bij,bjk,blk->bil", R, system.inertia, R)


def _kic(system, at):
    return body_kic(system, at, velocity_map(system, at)[0])


def _inertia_field(system, at):
    G, inertia = _kic(system, at), world_inertias(system, at)
    G_r, G_t = G[:, :3], G[:, 3:]
    return jnp.einsum("k,kci,kcj->ij", system.mass, G_t, G_t) + jnp.einsum("kci,kcd,kdj->ij", G_r, inertia, G_r)


@question
def inertia_field(system: System, state: State) -> Float[Array, "N N"]:
    """I* (N, N) = sum over bodies `m G_t^T G_t + G_r^T I G_r` (printed with one G_r in the mass term).

    Source: S2 (35); p = I* phi_dot, S2 (30), (34).
    """
    return _inertia_field(system, _at(system, state))


@question
def gyristor_field(system: System, state: State) -> Float[Array, "N N"]:
    """GR (N, N) = sum over bodies `m Gt_dot^T G_t + Gr_dot^T I G_r`, along the motion.  Source: S2 (41)."""
    at = _at(system, state)
    G, H, inertia = _kic(system, at), body_kic_second(system, at), world_inertias(system, at)
    G_dot = jnp.einsum("bcnm,m->bcn", H, independent_rates(system, state))
    translation = jnp.einsum("k,kci,kcj->ij", system.mass, G_dot[:, 3:], G[:, 3:])
    return translation + jnp.einsum("kci,kcd,kdj->ij", G_dot[:, :3], inertia, G[:, :3])


@question
def gyristor_field_direct(system: System, state):
    """GR~ (N, N), second form: row k is `1/2 phi_dot^T P*_k` with `P*_kij = dI*_ij/dphi_k` (print drops the 1/2).

    Its matrix differs from `gyristor_field`; the efforts agree, `GR phi_dot = GR~ phi_dot`.  For coordinates that
    are integrals of their velocities.  Source: S2 (47)-(54), (55).
    """
    planes = along_independent(system, _at(system, state), lambda at: _inertia_field(system, at))
    return 0.5 * jnp.einsum("i,ijk->kj", independent_rates(system, state), planes)


def independent_rates(system: System, state: State) -> Float[Array, " N"]:
    """phi_dot (N,): velocities of the independent columns."""
    check_fits(system, state)
    return state.velocities[independent_columns(system)]


@question
def generalised_momentum(system: System, state: State) -> Float[Array, " N"]:
    """p (N,) = sum over bodies `G_t^T m v + G_r^T I omega` of the total velocities.  Source: S2 (30)-(34)."""
    at = _at(system, state)
    Gamma, b = velocity_map(system, at)
    G, rate = body_kic(system, at, Gamma), coordinate_rate(system.topology, at.psi, b)
    free = jax.jvp(lambda psi: _com_and_axes(system, elsewhere(system, at, psi)), (at.psi,), (rate,))[1]
    V = jnp.einsum("bcn,n->bc", G, independent_rates(system, state)) + _free_twist(system, at, free)
    turning = jnp.einsum("bcd,bd->bc", world_inertias(system, at), V[:, :3])
    momentum = jnp.concatenate([turning, system.mass[:, None] * V[:, 3:]], axis=1)
    return jnp.einsum("bcn,bc->n", G, momentum)


def _com_and_axes(system, at):
    R, x = (part[body_frame(system.topology)] for part in (at.R, at.x))
    return R, x + jnp.einsum("bij,bj->bi", R, system.com)


def _free_twist(system, at, rates):
    """(bodies, 6) angular velocity and velocity of the centre of mass from rates of axes and centre."""
    R_dot, velocity = rates
    R, _ = _com_and_axes(system, at)
    spin = jnp.einsum("bij,bkj->bik", R_dot, R)
    omega = 0.5 * jnp.stack(
        [spin[:, 2, 1] - spin[:, 1, 2], spin[:, 0, 2] - spin[:, 2, 0], spin[:, 1, 0] - spin[:, 0, 1]], 1
    )
    return jnp.concatenate([omega, velocity], axis=1)


@question
def state_equations(system: System, state: State) -> tuple[Array, Array, Array]:
    """(p_dot, phi_dot, q_dot) of the paper at a state of a scleronomic system.

    `p_dot = +GR phi_dot + Q` (the print has a minus), `phi_dot = I*^-1 p`, `q_dot = Gi phi_dot`.
    Source: S2 (42)-(44).
    """
    at = _at(system, state)
    inertia = _inertia_field(system, at)
    p = inertia @ independent_rates(system, state)
    phi_dot = spd_solve(inertia, p)
    p_dot = gyristor_field(system, state) @ phi_dot + total_effort(system, state)
    return p_dot, phi_dot, velocity_map(system, at)[0][dependent_columns(system)] @ phi_dot
