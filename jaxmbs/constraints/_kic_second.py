"""Second-order kinematic influence coefficients: of the loops, and of every body, by `jax.jacfwd` and in vector form.

`H[n, :, m] = dG[:, n] / dphi_m`, the total derivative along the constraints: `G_dot[:, n] = H[n] phi_dot`.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ModelError
from ..kinematics._configuration import Configuration, at_coordinates, at_state
from ..kinematics._points import jacobian
from ..kinematics._poses import step_coordinates
from ..math._linalg import full_rank_lstsq
from ..math._tensor import left_product, plane_mix, right_product
from ..model._system import AbstractState, System
from ..quantities import entries
from ..reports import Report, Reported
from ..typing import AnyArray, FrameLike
from . import _constraints as constraints
from ._kic import body_kic, dependent_columns, independent_columns, velocity_map
from ._mobility import independent_state_function


def along_independent(system: System, at: Configuration, function):
    """Total derivative of `function(configuration)` by the independent coordinates: (..., N), by `jax.jacfwd`.

    The others follow to first order, `psi (+) Gamma dphi`, which is all that the derivative sees: no root is sought.

    Source: S2 (7), (17)."""
    Gamma = velocity_map(system, at)[0]

    def moved(dphi):
        return function(at_coordinates(system, at, step_coordinates(system.topology, at.psi, Gamma @ dphi)))

    return jax.jacfwd(moved)(jnp.zeros(Gamma.shape[1], at.psi.dtype))


def velocity_map_second(system: System, at: Configuration):
    """dGamma / dphi (nv, N, N): zero at the independent rows, Hi at the dependent ones."""
    return along_independent(system, at, lambda at: velocity_map(system, at)[0])


@independent_state_function
def internal_kic_second(system: System, state: AbstractState) -> Float[Array, "M N N"]:
    """Hi (M, N, N): `q_ddot = Gi phi_ddot + phi_dot^T . Hi . phi_dot`, by `jax.jacfwd` of Gi along (1, Gi).

    Drives add accelerations of their own, which Hi does not hold.  No root is sought inside the derivative.
    Source: S2 (7)-(9).
    """
    return velocity_map_second(system, at_state(system, state, inertias=False))[dependent_columns(system)]


@independent_state_function
def internal_kic_second_printed(system: System, state: AbstractState) -> Float[Array, "M N N"]:
    """Hi (M, N, N) as printed, `-(df/dq)^-1 (+) {f_pp + f_pq . Gi + Gi^T . f_qp + Gi^T . f_qq . Gi}`.

    Planes of second derivatives are rows k of f, then `[k, i, j] = d2 f_k / dq_i dphi_j` as (10) orders them.  For
    coordinates that are integrals of their velocities.

    Raises: ModelError for quaternions.  Source: S2 (8)-(10), products (77)-(84).
    """
    if system.topology.quaternion_joints:
        names = ", ".join(system.topology.quaternion_joints)
        raise ModelError(
            [
                f"internal_kic_second_printed: the velocities of {names} are no rates of coordinates (quaternions); "
                "ask internal_kic_second"
            ]
        )
    at = at_state(system, state, inertias=False)
    p, q = independent_columns(system), dependent_columns(system)
    f_xx = jax.jacfwd(lambda x: constraints.jacobian(system, at_coordinates(system, at, x)))(at.psi)
    Gi = velocity_map(system, at)[0][q]
    f_pp, f_pq, f_qp, f_qq = (f_xx[:, a][:, :, b] for a in (p, q) for b in (p, q))
    planes = f_pp + right_product(f_pq, Gi) + left_product(Gi.T, f_qp)
    planes = planes + right_product(left_product(Gi.T, f_qq), Gi)
    left_inverse = full_rank_lstsq(constraints.jacobian(system, at)[:, q], jnp.eye(planes.shape[0]))
    return -plane_mix(left_inverse, planes)


class SecondKic(Reported, eqx.Module):
    """Second-order KIC: `internal` Hi (M, N, N); `rotational`, `translational` (N, 3, N) by body name."""

    internal: Float[Array, "m n n"]
    rotational: dict
    translational: dict

    def report(self) -> Report:
        parts = (("rotational", self.rotational), ("translational", self.translational))
        found = [entries(f"{what} {body}", x) for what, by in parts for body, x in by.items()]
        return Report([entries("internal", self.internal), *found])


def body_kic_second(system: System, at: Configuration):
    """(bodies, 6, N, N) derivative of the external KIC by the independent coordinates, by forward mode.

    Axes: body, component, n, m.  Source: S2 (17)-(18), (22)-(23), (26).
    """
    return along_independent(system, at, lambda at: body_kic(system, at, velocity_map(system, at)[0]))


def body_kic_second_vector(system: System, at: Configuration):
    """`body_kic_second` in vector form: every joint twist S_j turns with its frame, `dS_j/dphi_m = V_m x S_j`.

    Rotational part: `sum_i sum_{j before i} w_in w_jm (z_j x z_i) + sum_i Hi[s(i), n, m] z_i`; the translational
    part, not printed, is its moment about the moving centre of mass.  Source: S2 (19)-(21), (24), (26).
    """
    top, S, R, x = system.topology, at.S, at.R, at.x
    Gamma, dGamma = velocity_map(system, at)[0], velocity_map_second(system, at)
    path = np.vstack([top.nodes.path, np.zeros((1, top.nodes.size), bool)])
    above = jnp.asarray(path[: top.nodes.size][top.column_frame], S.dtype)
    V = jnp.einsum("ji,im,ik->jmk", above, Gamma, S)  # twist of each column's frame per phi_m
    cross = jax.vmap(jax.vmap(jnp.cross, in_axes=(0, None)))  # (column, m) x (column)
    w, v, s, l = V[..., :3], V[..., 3:], S[:, :3], S[:, 3:]
    turned = jnp.concatenate([cross(w, s), cross(w, l) + cross(v, s)], axis=-1)
    of_body = jnp.asarray(path[np.asarray(top.body_node, int)], S.dtype)
    X = jnp.einsum("bj,jn,jk->bkn", of_body, Gamma, S)
    dX = jnp.einsum("bj,jnm,jk->bknm", of_body, dGamma, S) + jnp.einsum("bj,jn,jmk->bknm", of_body, Gamma, turned)
    index = np.arange(1, top.bodies.size + 1)
    com = x[index] + jnp.einsum("bij,bj->bi", R[index], system.com)

    def at_com(X, dX, com):
        g_r = X[:3]
        g_t = X[3:] + jax.vmap(jnp.cross, (1, None), 1)(g_r, com)
        moving = jax.vmap(jax.vmap(jnp.cross, (None, 1), 1), (1, None), 1)(g_r, g_t)
        moment = jax.vmap(jax.vmap(jnp.cross, (1, None), 1), (2, None), 2)(dX[:3], com)
        return jnp.concatenate([dX[:3], dX[3:] + moment + moving])

    return jax.vmap(at_com)(X, dX, com)


@independent_state_function
def kic_second(system: System, state: AbstractState) -> SecondKic:
    """Second-order KIC of a state, internal and of every body at its centre of mass, world axes, by `jax.jacfwd` of
    the first-order ones.

    H_t is symmetric in (n, m) for one-freedom joints and holonomic rows, H_r is not:
    `dg_n/dphi_m - dg_m/dphi_n = g_m x g_n`.  Source: S2 (7)-(9), (17)-(27).
    """
    at = at_state(system, state, inertias=False)
    return _by_name(system, at, body_kic_second(system, at))


@independent_state_function
def kic_second_vector(system: System, state: AbstractState) -> SecondKic:
    """The same as `kic_second` in the vector form of the paper: axes turned by the bodies that carry them.

    Source: S2 (19)-(21), (24), (26).
    """
    at = at_state(system, state, inertias=False)
    return _by_name(system, at, body_kic_second_vector(system, at))


def _by_name(system, at, second):
    H, names = jnp.swapaxes(second, 1, 2), system.topology.body_names
    return SecondKic(
        internal=velocity_map_second(system, at)[dependent_columns(system)],
        rotational={name: H[k, :, :3] for k, name in enumerate(names)},
        translational={name: H[k, :, 3:] for k, name in enumerate(names)},
    )


@independent_state_function
def point_kic(
    system: System, state: AbstractState, frame: FrameLike
) -> tuple[Float[Array, "6 N"], Float[Array, "N 6 N"]]:
    """First- and second-order KIC of a frame's origin or point: G (6, N) and H (N, 6, N), world axes.

    Translational rows before rotational ones; `frame` is a frame or body name, or (name, point).
    Source: S2 (11)-(12), (14)-(15), (17)-(18).
    """
    at = at_state(system, state, inertias=False)

    def G(at):
        moved = eqx.tree_at(lambda s: s.coordinates, state, at.psi)
        return jacobian(system, moved, frame) @ velocity_map(system, at)[0]

    return G(at), jnp.swapaxes(along_independent(system, at, G), 0, 1)


def kic_rate(second: AnyArray, phi_dot: AnyArray) -> Float[Array, "c N"]:
    """G_dot (3, N) of a body from its H (N, 3, N) and phi_dot (N,): column n is `H[n] phi_dot`.

    Where drives move the system too, G changes with them as well, which H does not hold: `dynamics.gyristor_field`
    has all of it.

    Source: S2 (22), (25)-(27).
    """
    if second.ndim != 3 or second.shape[0] != second.shape[2] or phi_dot.shape != second.shape[2:]:
        raise ValueError(f"H of shape {second.shape} and rates of shape {phi_dot.shape} are not (N, 3, N) and (N,)")
    return jnp.einsum("ncm,m->cn", second, phi_dot)
