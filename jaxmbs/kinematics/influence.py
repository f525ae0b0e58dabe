"""Kinematic influence coefficients of the first order: internal (loops) and external (bodies).

`u = Gamma phi_dot + b`: Gamma has a unit block at the independent velocities and the internal KIC Gi at the
dependent ones.  Bodies follow by `V_k = J_k u`.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..math.linalg import full_rank_lstsq
from ..model.question import question
from ..model.system import System
from . import constraints
from .poses import geometry, node_parameters


def independent_columns(system: System) -> np.ndarray:
    """Velocity columns chosen as independent (static)."""
    top = system.topology
    return np.arange(top.num_velocities) if top.analysis is None else np.asarray(top.analysis.independent, int)


def dependent_columns(system: System) -> np.ndarray:
    """The other velocity columns."""
    return np.setdiff1d(np.arange(system.topology.num_velocities), independent_columns(system))


def velocity_map(system: System, P, psi, t):
    """(Gamma (nv, N), b (nv,)): `u = Gamma phi_dot + b`, by full-column-rank least squares of `[A; P]`.

    Redundant rows do no harm.  Source: S2 (3)-(5); b is the part of driven joints and moving supports.
    """
    return velocity_map_at(system, geometry(system, P, psi) if system.has_constraints else None, psi, t)


def velocity_map_at(system: System, geo, psi, t):
    """`velocity_map` at known geometry."""
    n, chosen = system.topology.num_velocities, independent_columns(system)
    pick = np.eye(n, dtype=psi.dtype)[chosen]
    if not system.has_constraints:
        return jnp.asarray(pick.T), jnp.zeros(n, psi.dtype)
    A, f_t = constraints.jacobian_at(system, geo, psi, t), constraints.time_rate(system, psi, t)
    picked = np.eye(len(chosen), len(chosen) + 1, dtype=psi.dtype)
    upper = -f_t[:, None] * np.eye(1, len(chosen) + 1, len(chosen), dtype=psi.dtype)
    solution = full_rank_lstsq(jnp.concatenate([A, pick]), jnp.concatenate([upper, picked]))
    return solution[:, :-1], solution[:, -1]


def motion_map(system: System, geo, psi, t, known=None):
    """(Gamma (nv, N), B (nv, rows)): `Gamma w + B c` has the independent entries w and keeps the rows, `A x = c`;
    known: `constraints.directions`."""
    n, chosen = system.topology.num_velocities, independent_columns(system)
    pick = np.eye(n, dtype=psi.dtype)[chosen]
    if not system.has_constraints:
        return jnp.asarray(pick.T), jnp.zeros((n, 0), psi.dtype)
    rows = jnp.concatenate([constraints.jacobian_at(system, geo, psi, t, known), pick])
    inverse = full_rank_lstsq(rows, jnp.eye(len(rows), dtype=psi.dtype))
    return inverse[:, len(rows) - len(chosen) :], inverse[:, : len(rows) - len(chosen)]


def position_map(system: System, P, psi, t):
    """(nv, n): displacements of all columns per independent coordinate, rows of position alone.

    Equals Gamma unless rolling or blades restrict velocities further.
    """
    top = system.topology
    if not top.slip_rows:
        return velocity_map(system, P, psi, t)[0]
    pick = np.eye(top.num_velocities)[list(top.analysis.independent_positions)]
    A = constraints.jacobian(system, P, psi, t)[top.position_rows]
    right = np.concatenate([np.zeros((A.shape[0], len(pick))), np.eye(len(pick))])
    return full_rank_lstsq(jnp.concatenate([A, jnp.asarray(pick, psi.dtype)]), jnp.asarray(right, psi.dtype))


def point_jacobian(system: System, S, node, point):
    """(6, nv) angular velocity, then velocity of the `point` carried by `node` (-1: the ground), per velocity; the
    point is seen from where the twists S refer to.

    Source: S2 (11)-(12), (14)-(15) with every joint independent, 1 - alpha and alpha as S carries them.
    """
    path = np.vstack([system.topology.nodes.path, np.zeros((1, system.topology.nodes.size), bool)])[node]
    twist = S * jnp.asarray(path, S.dtype)[:, None]
    linear = twist[:, 3:] + jax.vmap(jnp.cross, in_axes=(0, None))(twist[:, :3], point)
    return jnp.concatenate([twist[:, :3], linear], axis=1).T


class Kic(eqx.Module):
    """First-order KIC by body name.

    Attributes:
        internal: Gi (M, N), dependent by independent velocities; S2 (5).
        rotational, translational: body name -> (3, N), world axes, at the centre of mass; S2 (12), (15).
        independent, dependent: velocity columns of the split (static).
    """

    internal: Float[Array, "m n"]
    rotational: dict
    translational: dict
    independent: tuple[int, ...] = eqx.field(static=True)
    dependent: tuple[int, ...] = eqx.field(static=True)


@question
def internal_kic(system: System, state):
    """Gi (M, N): rates of the dependent velocities per independent one.

    `Gi = -(df/dq)^-1 (df/dphi)` with the left inverse for redundant rows.  Source: S2 (3)-(5); its transpose maps
    efforts, `tau_phi = Gi^T tau_q`, S2 (6).
    """
    Gamma, _ = velocity_map(system, node_parameters(system), state.coordinates, state.t)
    return Gamma[dependent_columns(system)]


def body_kic(system: System, P, psi, t):
    """External KIC (bodies, 6, N): angular velocity and velocity of the centre of mass per independent velocity."""
    geo = geometry(system, P, psi)
    return body_kic_at(system, geo, velocity_map_at(system, geo, psi, t)[0])


def body_kic_at(system: System, geo, Gamma):
    """`body_kic` at known geometry and velocity map (nv, N)."""
    top, own, S = system.topology, slice(1, system.topology.bodies.size + 1), geo.S
    com = geo.x[own] + jnp.einsum("bij,bj->bi", geo.R[own], system.com)
    path = np.vstack([top.nodes.path, np.zeros((1, top.nodes.size), bool)])[np.asarray(top.body_node, int)]
    twist = jnp.asarray(path, S.dtype)[:, :, None] * S[None]
    cross = jax.vmap(jax.vmap(jnp.cross, in_axes=(0, None)))
    J = jnp.concatenate([twist[..., :3], twist[..., 3:] + cross(twist[..., :3], com)], axis=-1)
    return jnp.einsum("bnk,ni->bki", J, Gamma)


@question
def kic(system: System, state) -> Kic:
    """First-order KIC of a state, internal and of every body.

    The independent set is the user's (`build(independent=...)`) or was chosen at build by pivoting.
    Source: S2 (3)-(6), (11)-(16).
    """
    geo = geometry(system, node_parameters(system), state.coordinates)
    Gamma = velocity_map_at(system, geo, state.coordinates, state.t)[0]
    G = body_kic_at(system, geo, Gamma)
    names = system.topology.body_names
    return Kic(
        internal=Gamma[dependent_columns(system)],
        rotational={name: G[k, :3] for k, name in enumerate(names)},
        translational={name: G[k, 3:] for k, name in enumerate(names)},
        independent=tuple(int(i) for i in independent_columns(system)),
        dependent=tuple(int(i) for i in dependent_columns(system)),
    )
