"""The inertia and gyristor fields of the paper in independent coordinates, and its state equations, term by term.

For analysis and for reading the bond graph; simulations use the tensor-free forms of `_hamilton.py`.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...assembly._state import State
from ...constraints._kic import body_kic, dependent_columns, independent_columns, velocity_map
from ...constraints._kic_second import along_independent
from ...constraints._mobility import independent_state_function, with_mobility_at
from ...constraints._rows import reads_time
from ...errors import ModelError
from ...kinematics._configuration import Configuration, at_coordinates, at_state, configuration, with_velocities
from ...kinematics._poses import body_frame, coordinate_rate
from ...math._spd import spd_solve
from ...model._entry_points import check_state
from ...model._system import System
from .._elastic import require_rigid
from ._ports import projected_total_effort


def _rigid_configuration(system, state):
    require_rigid(system, "the paper's fields")
    return at_state(system, state, inertias=False)


def world_inertias(system: System, at: Configuration):
    """Inertia (bodies, 3, 3) of every body about its centre of mass, world axes."""
    R = at.R[body_frame(system.topology)]
    return jnp.einsum("bij,bjk,blk->bil", R, system.inertia, R)


def _velocity_maps(system, at):
    """Gamma (nv, N) and G (bodies, 6, N): all velocities, and body motions, per independent velocity."""
    Gamma = velocity_map(system, at)[0]
    return Gamma, body_kic(system, at, Gamma)


def _velocity_maps_and_rate(system, at, u):
    """Gamma, G and G_dot (bodies, 6, N) along the motion at velocities u (nv,): `H phi_dot` without drives."""

    def maps(psi, t):
        return _velocity_maps(system, configuration(system, at.P, psi, t, inertias=False))

    along = coordinate_rate(system.topology, at.psi, u), jnp.ones_like(at.t)
    (Gamma, G), (_, G_dot) = jax.jvp(maps, (at.psi, at.t), along)
    return Gamma, G, G_dot


def require_holonomic_coordinates(system: System, what: str, driven: bool) -> None:
    """Refuse systems whose equations have more terms than the paper's: silently leaving them out would be wrong.

    Raises: ModelError where velocities are not the rates of coordinates, and with `driven` where drives move the
    system.
    """
    top, found = system.topology, []
    if top.quaternion_joints:
        names = ", ".join(top.quaternion_joints)
        found.append(f"{what}: the velocities of {names} are no rates of coordinates (quaternions)")
    if top.slip_rows:
        found.append(f"{what}: rows of velocity alone restrict the motion, it has more coordinates than velocities")
    moved = [name for group in system.rows if driven and reads_time(system, group) for name in group.names]
    if driven and (moved or system.paths):
        names = ", ".join([*moved, *system.paths])
        found.append(f"{what}: the motion has drives ({names}), or rows that read the time, whose terms it lacks")
    if found:
        raise ModelError([f"{fault}; ask gyristor_field, state_equations or forward_dynamics" for fault in found])


def _field(system, at, first, second):
    """Sum over bodies `m first_t^T second_t + first_r^T I second_r` (N, N)."""
    translation = jnp.einsum("k,kci,kcj->ij", system.mass, first[:, 3:], second[:, 3:])
    return translation + jnp.einsum("kci,kcd,kdj->ij", first[:, :3], world_inertias(system, at), second[:, :3])


def _inertia_field(system, at):
    G = _velocity_maps(system, at)[1]
    return _field(system, at, G, G)


@independent_state_function
def inertia_field(system: System, state: State) -> Float[Array, "N N"]:
    """I* (N, N) = sum over bodies `m G_t^T G_t + G_r^T I G_r` (printed with one G_r in the mass term).

    Source: S2 (35); p = I* phi_dot, S2 (30), (34).
    """
    return _inertia_field(system, _rigid_configuration(system, state))


@independent_state_function
def gyristor_field(system: System, state: State) -> Float[Array, "N N"]:
    """GR (N, N) = sum over bodies `m Gt_dot^T G_t + Gr_dot^T I G_r`, along the motion, drives included.

    With drives the momenta have a part beside `I* phi_dot`, which `state_equations` adds.  Source: S2 (41).
    """
    at = _rigid_configuration(system, state)
    _, G, G_dot = _velocity_maps_and_rate(system, at, state.velocities)
    return _field(system, at, G_dot, G)


@independent_state_function
def gyristor_field_direct(system: System, state: State) -> Float[Array, "N N"]:
    """GR~ (N, N), second form: row k is `1/2 phi_dot^T P*_k` with `P*_kij = dI*_ij/dphi_k` (print drops the 1/2).

    Its matrix differs from `gyristor_field`; the efforts agree, `GR phi_dot = GR~ phi_dot`.  For coordinates that
    are integrals of their velocities, and motions without drives.

    Raises: ModelError for quaternions, rows of velocity alone, drives and rows that read the time.
    Source: S2 (47)-(54), (55).
    """
    require_holonomic_coordinates(system, "gyristor_field_direct", driven=True)
    planes = along_independent(system, _rigid_configuration(system, state), lambda at: _inertia_field(system, at))
    return 0.5 * jnp.einsum("i,ijk->kj", independent_rates(system, state), planes)


def independent_rates(system: System, state: State) -> Float[Array, " N"]:
    """phi_dot (N,): velocities of the independent columns."""
    check_state(system, state)
    return state.velocities[independent_columns(with_mobility_at(system, state))]


@independent_state_function
def generalised_momentum(system: System, state: State) -> Float[Array, " N"]:
    """p (N,) = sum over bodies `G_t^T m v + G_r^T I omega` of the total velocities.  Source: S2 (30)-(34)."""
    at = _rigid_configuration(system, state)
    Gamma, b = velocity_map(system, at)
    G = body_kic(system, at, Gamma)
    return jnp.einsum("bcn,bc->n", G, _body_momenta(system, at, G @ independent_rates(system, state), b))


def _body_momenta(system, at, V, b):
    """Angular momenta about the centres and momenta (bodies, 6), of what the independent velocities make of the
    motion of the bodies V (bodies, 6) and what the drives add, velocities b (nv,)."""
    rate = coordinate_rate(system.topology, at.psi, b)
    free = jax.jvp(lambda psi: _axes_and_centres(system, at_coordinates(system, at, psi)), (at.psi,), (rate,))[1]
    V = V + _twist_of_rates(system, at, free)
    turning = jnp.einsum("bcd,bd->bc", world_inertias(system, at), V[:, :3])
    return jnp.concatenate([turning, system.mass[:, None] * V[:, 3:]], axis=1)


def _axes_and_centres(system, at):
    R, x = (part[body_frame(system.topology)] for part in (at.R, at.x))
    return R, x + jnp.einsum("bij,bj->bi", R, system.com)


def _twist_of_rates(system, at, rates):
    """Angular velocity and velocity of the centre of mass (bodies, 6) from rates of axes and centre."""
    R_dot, velocity = rates
    R, _ = _axes_and_centres(system, at)
    spin = jnp.einsum("bij,bkj->bik", R_dot, R)
    omega = 0.5 * jnp.stack(
        [spin[:, 2, 1] - spin[:, 1, 2], spin[:, 0, 2] - spin[:, 2, 0], spin[:, 1, 0] - spin[:, 0, 1]], 1
    )
    return jnp.concatenate([omega, velocity], axis=1)


@independent_state_function
def state_equations(system: System, state: State) -> tuple[Array, Array, Array]:
    """State equations of the paper at a state, drives included: (p_dot, phi_dot, q_dot).

    `p_dot = +GR phi_dot + Q` (the print has a minus), `phi_dot = I*^-1 p`, `q_dot = Gi phi_dot`; drives
    add what they move to the momenta of bodies, behind GR, and to q_dot.
    Source: S2 (42)-(44).
    """
    at, rates, u = _rigid_configuration(system, state), independent_rates(system, state), state.velocities
    Gamma, G, G_dot = _velocity_maps_and_rate(system, at, u)
    b = velocity_map(system, at)[1]
    inertia = _field(system, at, G, G)
    momenta = _body_momenta(system, at, G @ rates, b)
    phi_dot = spd_solve(inertia, inertia @ rates)
    p_dot = jnp.einsum("bcn,bc->n", G_dot, momenta) + projected_total_effort(
        system, with_velocities(system, at, u), Gamma
    )
    dependent = dependent_columns(system)
    return p_dot, phi_dot, Gamma[dependent] @ phi_dot + b[dependent]
