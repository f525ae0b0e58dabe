"""Inverse dynamics: efforts that a motion requires, on the tree's velocities or of actuators in closed loops."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..assembly._state import HasStates, State
from ..checks import distinct_names, place_of
from ..constraints import _closures as closures
from ..constraints import _constraints as constraints
from ..constraints._linear_rows import metric
from ..dynamics._efforts import efforts
from ..dynamics._joint_friction import FrictionSolution, rubbing, solve_friction
from ..dynamics._newton_euler import accelerations, required_efforts
from ..dynamics._shared_loads import wrenches_lacking
from ..errors import ModelError
from ..kinematics._configuration import VelocityKinematics, at_state, node_accelerations, with_velocities
from ..kinematics._wrench_targets import node_targets
from ..math._linalg import RowScale, relative, saddle_solve
from ..model._changes import with_changes
from ..model._entry_points import map_states, rates_of, states_of
from ..model._system import System
from ..quantities import Quantity, along_freedoms
from ..reports import Report, Reported, failures
from ..runtime import jit, map_chunked
from ..typing import ArrayLike
from ._row_residuals import ROUNDING_TOLERANCE, relative_row_residual, row_residuals
from ._without_drives import without_drives


class Actuation(Reported, eqx.Module):
    """Efforts of chosen actuators for a motion.

    Attributes:
        efforts: (..., n) along the freedoms of each joint, by name [N or N m].
        gap: (...) largest part of the required efforts that the actuators cannot provide, relative.
        row_gap: (...) largest violation of the loops and other rows by the accelerations, relative.
        ok: (...) true where both gaps are rounding: the motion is possible and the actuators can produce it.
        t: (...) times [s].
    """

    efforts: dict[str, Float[Array, "... n"]]
    gap: Float[Array, "..."]
    row_gap: Float[Array, "..."]
    ok: Bool[Array, "..."]
    t: Float[Array, "..."] | None = None

    def report(self) -> Report:
        gaps = [Quantity("gap of efforts", self.gap), Quantity("gap of rows", self.row_gap)]
        found = [along_freedoms(name, effort) for name, effort in self.efforts.items()]
        return Report([*found, *gaps], fault=failures(self.ok, "the actuators cannot produce the motion"), t=self.t)

    def __getitem__(self, name: str) -> Float[Array, "... n"]:
        place_of("actuator", name, tuple(self.efforts))
        return self.efforts[name]


def inverse_dynamics(
    system: System,
    state: State | HasStates,
    acceleration: ArrayLike | Mapping[str, ArrayLike] | None = None,
    actuators: Sequence[str] | None = None,
) -> Array | Actuation:
    """Efforts that produce accelerations, beside gravity and all force elements.

    Args:
        state: a State; with actuators also a Motion, or a State with one leading axis.
        acceleration: (nv,), with the states' leading axis if they have one, or by joint.
            Default, with actuators: those of the system with its drives, so that a model driven along a path gives
            the efforts that other actuators need for it.
        actuators: names of joints whose efforts replace all drives and frame paths; the loops carry what they can.
            With more actuators than freedoms, the efforts of least norm, forces times the system's `length`.

    Returns: efforts (nv,) on the tree's velocities, multipliers not subtracted; with actuators an `Actuation`.

    Raises: UnknownNameError; ModelError for an actuator without freedom or at a cut joint; TypeError without
    acceleration and actuators.  Source: S2 (40), (6) with the loops' rows.
    """
    states = states_of(system, state)
    acceleration = None if acceleration is None else rates_of(system, states, acceleration, "acceleration")
    if actuators is None:
        if acceleration is None:
            raise TypeError("give `acceleration` (nv,), or `actuators`: the joints that drive the motion")
        if system.friction is not None and system.closures:
            raise ModelError(
                [
                    f"friction {', '.join(map(repr, system.friction.names))}: the loads of joints in loops need all "
                    "multipliers; name the joints that drive the motion, actuators=[...]"
                ],
                what="inverse_dynamics",
            )
        return _all_tree_efforts(system, states, acceleration)
    actuators = distinct_names("actuators", actuators)
    columns = actuated_columns(system, actuators)
    found, gap, row_gap, ok = _actuator_efforts(system, states, acceleration, columns, states.coordinates.ndim == 2)
    ends = np.cumsum([0, *(b - a for a, b in columns)])
    named = {n: found[..., a:b] for n, a, b in zip(actuators, ends[:-1], ends[1:], strict=True)}
    return Actuation(named, gap, row_gap, ok, states.t)


def actuated_columns(system: System, actuators: Sequence[str]) -> tuple[tuple[int, int], ...]:
    """First and last velocity of every actuator.

    Raises: UnknownNameError; ModelError for one without freedom, at a cut joint, or named twice, and where none is.
    """
    top, found = system.topology, []
    actuators = distinct_names("actuators", actuators)
    if not actuators:
        raise ModelError(["the list of actuators is empty: name at least one joint that drives the motion"])
    for name in actuators:
        joint = top.joints[place_of("joint", name, top.joint_names)]
        if joint.is_cut or joint.velocities.start == joint.velocities.stop:
            raise ModelError(
                [
                    f"joint {name!r} cannot be an actuator: it is rigid or cut, so it has no velocity of its own; if "
                    "it closes a loop, cut the loop at another joint"
                ]
            )
        found.append((joint.velocities.start, joint.velocities.stop))
    return tuple(found)


@jit
def _all_tree_efforts(system, states, acceleration):
    def one(state, acceleration):
        here = with_changes(system, state)
        at = with_velocities(here, at_state(here, state), state.velocities)
        loads = efforts(here, at)[:2]
        need = tree_efforts(here, at, acceleration, loads)
        if here.friction is None:
            return need
        multipliers = jnp.zeros((1 + len(here.friction.names), here.topology.num_rows), need.dtype)
        a, targets = acceleration[None], node_targets(here)
        lack = wrenches_lacking(here, at, targets, a, loads[0], len(multipliers))
        found = solve_friction(here, at, rubbing(here, at), lack, a, multipliers)
        return need - jnp.sum(found.efforts, axis=0)

    return map_states(one, states, jnp.asarray(acceleration, states.coordinates.dtype))


def tree_efforts(system: System, at: VelocityKinematics, acceleration, loads=None):
    """`required_efforts` (nv,) at accelerations (nv,); loads: of the force elements, if known."""
    V_dot = node_accelerations(system.topology, at, acceleration)
    return required_efforts(system, at, V_dot, acceleration, efforts(system, at)[:2] if loads is None else loads)


@jit
def _actuator_efforts(system, states, acceleration, columns, batched):
    def one(row):
        state, a = row
        here = with_changes(system, state)
        at = with_velocities(here, at_state(here, state), state.velocities)
        a = accelerations(here, at)[0] if a is None else a
        released, loads = without_drives(here), efforts(here, at)[:2]
        need = tree_efforts(here, at, a, loads)
        found = balance_with_friction(released, at, a, need, loads, columns)[0]
        row_gap = _row_residual(released, at, a, need)
        least = ROUNDING_TOLERANCE[row_gap.dtype.itemsize]
        return found.efforts, found.gap, row_gap, state.ok & (found.gap <= least) & (row_gap <= least)

    acceleration = None if acceleration is None else jnp.asarray(acceleration, states.coordinates.dtype)
    return map_chunked(one, (states, acceleration)) if batched else one((states, acceleration))


def _row_residual(system, at, a, need):
    """`relative_row_residual` of accelerations (nv,) that take the efforts needed (nv,)."""
    at = closures.with_directions(system, at)
    V_dot, gaps = node_accelerations(system.topology, at, a), row_residuals(system, at, a)
    return relative_row_residual(system, at, a, V_dot, gaps, (jnp.zeros((0, 6), need.dtype), need))


class EffortBalance(NamedTuple):
    """Efforts (k,) of the actuators' columns, the same on all columns (nv,), multipliers (rows,), and the gap."""

    efforts: Array
    columns: Array
    multipliers: Array
    gap: Array


def balance_with_friction(
    system: System, at: VelocityKinematics, a, need, loads, columns, compliance=None
) -> tuple[EffortBalance, FrictionSolution | None]:
    """`balance_efforts` of the efforts needed (nv,) and of the friction of the joints at accelerations a (nv,), which
    is None where none rubs; loads: of the force elements on nodes and columns; compliance: see `reactions`."""
    if system.friction is None:
        return balance_efforts(system, at, need, columns), None
    rub = rubbing(system, at)
    free, each, efforts, multipliers = _balance_columns(
        system, at, jnp.concatenate([need[None], -rub.efforts]), columns
    )
    lack = wrenches_lacking(system, at, node_targets(system), a[None], loads[0], len(multipliers))
    found = solve_friction(system, at, rub, lack, a[None], multipliers, compliance)
    # every part of the balance is linear in the efforts needed
    share = jnp.concatenate([jnp.ones(1, a.dtype), found.surfaces.resistance(found.total)])
    tau = share @ efforts
    gap = _balance_gap(system, each, tau, free @ share)
    return EffortBalance(tau, tau @ _columns_of(columns, need), share @ multipliers, gap), found


def _balance_columns(system, at, needs, columns):
    """Balance of several efforts needed (k, nv) by one factor.

    Returns: what the loops leave of them (nv, k), and of unit efforts of the actuators (nv, m): motion under each;
    efforts (k, m) of the actuators, of least norm; multipliers (k, rows) that the loops carry.
    """
    k, m, weight = len(needs), sum(b - a for a, b in columns), metric(system)
    parts, held = jnp.concatenate([needs, _columns_of(columns, needs)]), jnp.zeros((k + m, 0), needs.dtype)
    if system.has_constraints:
        A, rows = constraints.jacobian(system, at), constraints.row_scale(system)
        still = jnp.zeros((system.topology.num_rows, k + m), needs.dtype)
        moved, held = (x.T for x in saddle_solve(jnp.diag(weight), A, parts.T, still, rows))
        parts = moved * weight[None]
    free, each, unit = parts[:k].T, parts[k:].T, _effort_units(system, needs.dtype)
    own = np.concatenate([np.arange(a, b) for a, b in columns])
    rows = RowScale(jax.lax.stop_gradient(unit), np.arange(len(unit)))
    efforts = saddle_solve(jnp.diag(unit[own] ** 2), each, jnp.zeros((m, k), needs.dtype), free, rows)[0].T
    return free, each, efforts, held[:k] - efforts @ held[k:]


def _columns_of(columns, like):
    """(m, nv): ones in the columns of the actuators."""
    own = np.concatenate([np.arange(a, b) for a, b in columns])
    return jnp.asarray(np.eye(like.shape[-1])[own], like.dtype)


def _effort_units(system, dtype):
    """(nv,): forces count as moments at the system's length."""
    return jnp.where(jnp.asarray(system.topology.spins, dtype) > 0.0, 1.0, system.length)


def _balance_gap(system, each, tau, free):
    """Largest part of the efforts that are free (nv,) which efforts tau (m,) do not provide, relative."""
    unit = _effort_units(system, free.dtype)
    return relative(unit * (each @ tau - free), unit * (jnp.abs(each) @ jnp.abs(tau) + jnp.abs(free)))


def balance_efforts(system: System, at: VelocityKinematics, need, columns) -> EffortBalance:
    """Actuators and rows that balance the efforts needed (nv,), `E tau + A^T lambda = need`, tau of least norm."""
    free, each, efforts, multipliers = _balance_columns(system, at, need[None], columns)
    gap = _balance_gap(system, each, efforts[0], free[:, 0])
    return EffortBalance(efforts[0], efforts[0] @ _columns_of(columns, need), multipliers[0], gap)
