"""Kinematic influence coefficients of the first order: internal (loops) and external (bodies).

`u = Gamma phi_dot + b`: Gamma has a unit block at the independent velocities and the internal KIC Gi at the
dependent ones.  Bodies follow by `V_k = J_k u`.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..kinematics._configuration import Configuration, at_state
from ..math._linalg import full_rank_lstsq
from ..model._system import AbstractState, System
from ..quantities import XYZ, Axis, Quantity
from ..reports import Report, Reported
from . import _closures as closures
from . import _constraints as constraints
from ._linear_rows import linear_rows
from ._linear_solver import linear_solver
from ._mobility import dependent_columns, independent_columns, independent_state_function


def velocity_map(system: System, at: Configuration):
    """(Gamma (nv, N), b (nv,)): `u = Gamma phi_dot + b`, by full-column-rank least squares of `[A; P]`.

    Redundant rows do no harm.  Source: S2 (3)-(5); b is the part of driven joints and moving supports.
    """
    n, chosen, dtype = system.topology.num_velocities, independent_columns(system), at.psi.dtype
    pick = np.eye(n, dtype=dtype)[chosen]
    if not system.has_constraints:
        return jnp.asarray(pick.T), jnp.zeros(n, dtype)
    if linear_solver(system) == "frontal":
        at = closures.with_directions(system, at)
        move, f_t = _move_without_matrix(system, at, chosen), constraints.time_rate(system, at)
        picked, c = jnp.eye(len(chosen) + 1, len(chosen), dtype=dtype), jnp.zeros((len(chosen) + 1, len(f_t)), dtype)
        columns = jax.vmap(move, out_axes=1)(picked, c.at[-1].set(-f_t))
        return columns[:, :-1], columns[:, -1]
    A, f_t = constraints.jacobian(system, at), constraints.time_rate(system, at)
    picked = np.eye(len(chosen), len(chosen) + 1, dtype=dtype)
    upper = -f_t[:, None] * np.eye(1, len(chosen) + 1, len(chosen), dtype=dtype)
    solution = full_rank_lstsq(jnp.concatenate([A, pick]), jnp.concatenate([upper, picked]))
    return solution[:, :-1], solution[:, -1]


def motion_map(system: System, at: Configuration):
    """Function of w (N,) and c (rows,): the velocities x (nv,) with the independent entries w and `A x = c`.

    Args: at: `closures.with_directions`.  Source: S2 (3)-(5), with the rates c of the rows.
    """
    n, chosen, dtype = system.topology.num_velocities, independent_columns(system), at.psi.dtype
    pick = np.eye(n, dtype=dtype)[chosen]
    if not system.has_constraints:
        return lambda w, c: jnp.asarray(pick.T) @ w
    if linear_solver(system) == "frontal":
        return _move_without_matrix(system, at, chosen)
    rows = jnp.concatenate([constraints.jacobian(system, at), pick])
    inverse = full_rank_lstsq(rows, jnp.asarray(np.eye(len(rows), dtype=dtype)))
    return lambda w, c: inverse @ jnp.concatenate([c, w])


def position_map(system: System, at: Configuration):
    """(nv, n): displacements of all columns per independent coordinate, rows of position alone: what Gamma is for
    rates, and differs from it where rolling or blades restrict velocities further."""
    top = system.topology
    assert top.analysis is not None
    chosen = np.array(top.analysis.independent_positions, int)
    pick = np.eye(top.num_velocities, dtype=at.psi.dtype)[chosen]
    if linear_solver(system) == "frontal":
        at = closures.with_directions(system, at)
        move = _move_without_matrix(system, at, chosen, top.position_rows)
        return jax.vmap(lambda w: move(w, jnp.zeros(len(top.position_rows), w.dtype)), out_axes=1)(pick[:, chosen])
    A = constraints.jacobian(system, at)[top.position_rows]
    right = np.concatenate([np.zeros((A.shape[0], len(pick))), np.eye(len(pick))])
    return full_rank_lstsq(jnp.concatenate([A, jnp.asarray(pick)]), jnp.asarray(right, at.psi.dtype))


def _move_without_matrix(system, at, chosen, places=None):
    """`motion_map` without a matrix, for some columns and rows at some places: the others take the least step."""
    free = np.ones(system.topology.num_velocities)
    free[chosen] = 0.0
    others, every = (
        linear_rows(system, at, jnp.asarray(x, at.psi.dtype), places) for x in (free, np.ones_like(free))
    )

    def move(w, c):
        held = jnp.zeros(len(free), w.dtype).at[chosen].set(w, unique_indices=True)
        return held + others.least_step(c - every.rates(held), fading=True)

    return move


class Kic(Reported, eqx.Module):
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

    def report(self) -> Report:
        split = [
            Axis(name, tuple(map(str, own)))
            for name, own in (("dependent", self.dependent), ("independent", self.independent))
        ]
        axes = (XYZ, split[1])
        parts = (("rotational", "", self.rotational), ("translational", "m/s per unit speed", self.translational))
        found = [Quantity(f"{what} {body}", x, unit, axes) for what, unit, by in parts for body, x in by.items()]
        return Report([Quantity("internal", self.internal, "", tuple(split)), *found], "by columns of velocities")


@independent_state_function
def internal_kic(system: System, state: AbstractState) -> Float[Array, "M N"]:
    """Gi (M, N): rates of the dependent velocities per independent one.

    `Gi = -(df/dq)^-1 (df/dphi)` with the left inverse for redundant rows.  Source: S2 (3)-(5); its transpose maps
    efforts, `tau_phi = Gi^T tau_q`, S2 (6).
    """
    Gamma, _ = velocity_map(system, at_state(system, state, inertias=False))
    return Gamma[dependent_columns(system)]


def body_kic(system: System, at: Configuration, Gamma):
    """External KIC (bodies, 6, N): angular velocity and velocity of the centre of mass per independent velocity, with
    Gamma (nv, N) of `velocity_map`."""
    top, own, S = system.topology, slice(1, system.topology.bodies.size + 1), at.S
    com = at.x[own] + jnp.einsum("bij,bj->bi", at.R[own], system.com)
    path = np.vstack([top.nodes.path, np.zeros((1, top.nodes.size), bool)])[np.asarray(top.body_node, int)]
    twist = jnp.asarray(path, S.dtype)[:, :, None] * S[None]
    cross = jax.vmap(jax.vmap(jnp.cross, in_axes=(0, None)))
    J = jnp.concatenate([twist[..., :3], twist[..., 3:] + cross(twist[..., :3], com)], axis=-1)
    return jnp.einsum("bnk,ni->bki", J, Gamma)


@independent_state_function
def kic(system: System, state: AbstractState) -> Kic:
    """First-order KIC of a state, internal and of every body.

    The independent set is the user's (`build(independent=...)`) or was chosen at build by pivoting.
    Source: S2 (3)-(6), (11)-(16).
    """
    at = at_state(system, state, inertias=False)
    Gamma = velocity_map(system, at)[0]
    G = body_kic(system, at, Gamma)
    names = system.topology.body_names
    return Kic(
        internal=Gamma[dependent_columns(system)],
        rotational={name: G[k, :3] for k, name in enumerate(names)},
        translational={name: G[k, 3:] for k, name in enumerate(names)},
        independent=tuple(int(i) for i in independent_columns(system)),
        dependent=tuple(int(i) for i in dependent_columns(system)),
    )
