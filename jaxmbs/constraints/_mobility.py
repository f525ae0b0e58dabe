"""Mobility at a pose: independent set, redundancy and statically undetermined reactions, counted on the host.

All of it belongs to a pose, not to a mechanism: a scissor lift drawn flat has another mobility than when it works.
`build` counts at one pose; `with_mobility_at` counts again at a state where that pose differs.
"""

import dataclasses
import functools
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..checks import distinct_names, is_sparse, no_such
from ..errors import ModelError
from ..kinematics._configuration import configuration
from ..kinematics._poses import node_parameters
from ..math._pivoting import pivoted_columns
from ..model._changes import with_changes
from ..model._entry_points import check_state, state_function, states_of
from ..model._system import System
from ..model._topology import Mobility, Topology
from ..runtime import as_array, jit
from . import _constraints as constraints
from . import _reaction_map as reaction_map
from ._host_rows import RowEvaluation, evaluate_rows, runs_on_host
from ._rank import constraint_rank, constraint_spaces, weighted_columns

_SINGULAR_MOTION = 1e-6  # a set that moves less than this with some null vector of unit length does not determine it
Function = TypeVar("Function", bound=Callable)


def count_mobility(system: System, state: Any) -> Mobility:
    """Freedoms, redundancy and independent set at one concrete State, see `Mobility`.

    Raises: as `check_state`; TypeError within a trace and for several states; ValueError where it is not finite.
    """
    check_state(system, state)
    if not runs_on_host(system, state) or state.coordinates.ndim != 1:
        raise TypeError("the mobility is counted at one known state, outside of jit, vmap and derivatives")
    if not np.isfinite(state.coordinates).all():
        raise ValueError(f"the mobility is counted at a state of finite coordinates, got {state.coordinates}")
    return _mobility_at(system, np.asarray(state.coordinates), np.asarray(state.t))


def with_mobility_at(system: System, state: Any) -> System:
    """The system with the mobility of a concrete State: that of the build where it is valid there, else one counted
    there.

    Of several states, as of a motion, the first counts, and only where its rank is higher than that of the build: it
    may be a singular one.  Within a trace the system is returned unchanged: shapes are those of the build there.
    """
    own, several = system.topology.analysis, state.coordinates.ndim > 1
    if not system.has_constraints or own is None or not runs_on_host(system, state):
        return system
    psi, t = (np.asarray(x) for x in (state.coordinates, state.t))
    if several:
        psi, t = psi.reshape(-1, psi.shape[-1])[0], t.reshape(-1)[0]
    if not np.isfinite(psi).all():
        return system
    found = _mobility_at(system, psi, t)
    if several and found.rank <= own.rank:
        return system
    fits = (found.independent, found.independent_positions) == (own.independent, own.independent_positions)
    return system if fits else with_mobility(system, found)  # the same program where only marks differ


def independent_state_function(function: Function) -> Function:
    """A `state_function` whose result refers to the independent velocities: those counted at its state."""
    asked = state_function(function)

    @functools.wraps(function)
    def ask(system, state, *args, **kwargs):
        state = states_of(system, state)
        system = with_mobility_at(with_changes(system, state) if state.t.ndim == 0 else system, state)
        return nan_unless_determined(system, state, asked(system, state, *args, **kwargs))

    return ask  # type: ignore[return-value]


def nan_unless_determined(system: System, state, answer):
    """A traced result, NaN where the independent set of the build does not determine the motion at the state.

    Shapes cannot depend on the state in a trace.  Results for concrete states are unchanged: `with_mobility_at` has
    counted there.
    """
    if not system.has_constraints or runs_on_host(system, state) or state.coordinates.ndim != 1:
        return answer
    fits = is_determined(system, state.coordinates, state.t)
    numbers = lambda x: eqx.is_inexact_array(x) and x.size > 0
    return jax.tree.map(lambda x: jnp.where(fits, x, jnp.nan).astype(x.dtype) if numbers(x) else x, answer)


@jit(compile="tape")
def is_determined(system: System, psi, t):
    """True if the independent velocities determine the motion at coordinates psi, and are as many as its freedoms."""
    at = configuration(system, node_parameters(system), psi, t, inertias=False)
    A, chosen = constraints.jacobian(system, at), independent_columns(system)
    pick = np.eye(A.shape[1], dtype=A.dtype)[chosen]
    both = jnp.stack([jnp.concatenate([A, part]) for part in (0.0 * pick, pick)])  # rows of zeros have no rank
    ranks = jax.vmap(lambda A: constraint_rank(system, A))(both)
    return jnp.all(ranks == np.array([A.shape[1] - len(chosen), A.shape[1]]))


def _mobility_at(system: System, psi, t) -> Mobility:
    """`Mobility` at coordinates psi (nq,) and time t; the system's own independent set is kept where it is valid."""
    rows = evaluate_rows(system, psi, t)
    broken = np.array(system.topology.row_joint)[~rows.is_finite]
    if broken.size:
        raise ValueError(f"the constraint rows of {', '.join(dict.fromkeys(broken))} are not finite at this state")
    return mobility_of(system, rows, row_spaces(system, rows))


def row_spaces(system: System, rows: RowEvaluation):
    """`constraint_spaces` of the rows that `evaluate_rows` gave."""
    return constraint_spaces(weighted_columns(system, rows.A), float(system.length))


def mobility_of(system: System, rows: RowEvaluation, spaces, wanted: Iterable[str] | None = None) -> Mobility:
    """`Mobility` from the rows at a pose and their `row_spaces`.

    Args: wanted: joints whose velocities are to be the independent ones.

    Raises: ModelError where these do not determine the motion.
    """
    top, (rank, Z, Y) = system.topology, spaces
    old = top.analysis or Mobility(0, 0, 0, ())
    chosen = (
        _nearest_independent_set(Z, old.independent or tuple(int(k) for k in top.deformations))
        if wanted is None
        else _requested_independent_set(top, Z, tuple(wanted))
    )
    positions = chosen
    if top.slip_rows:
        Z = row_spaces(system, rows._replace(A=rows.A[top.position_rows]))[1]
        positions = _nearest_independent_set(Z, chosen)
    undetermined, names = _undetermined_components(
        reaction_map.reaction_carriers(system), rows.reactions, Y, float(system.length)
    )
    names += tuple(name for name in _self_stressed_rows(system, Y) if name not in names)
    counted = rank, top.num_rows, top.num_velocities, chosen, undetermined, names, positions
    return Mobility(
        *counted, _column_dependencies(Z, positions), old.pose_dependent_rows, _ranks_by_name(system, rows)
    )


def _column_dependencies(Z, positions):
    """Independent columns, by their place in the set, on which each column depends; Z: null space of the rows."""
    if Z.shape[0] == Z.shape[1]:  # a tree
        return ()
    share = np.abs(np.linalg.lstsq(Z[list(positions)].T, Z.T, rcond=None)[0].T)
    return tuple(tuple(int(k) for k in np.nonzero(row > 1e-6)[0]) for row in share)


def _ranks_by_name(system, rows):
    """Rank of the position rows of each joint or constraint by itself."""
    top, found = system.topology, []
    A = weighted_columns(system, rows.A[top.position_rows])
    of_name: dict[str, list[int]] = {}
    for row, name in enumerate(np.array(top.row_joint, str)[top.position_rows]):
        of_name.setdefault(str(name), []).append(row)
    for name, own in of_name.items():
        part = A[own]
        if is_sparse(part):
            part = part[:, np.unique(part.indices)].toarray()
        found.append((name, constraint_spaces(part, float(system.length))[0]))
    return tuple(found)


def independent_columns(system: System) -> np.ndarray:
    """Velocity columns chosen as independent (static)."""
    top = system.topology
    return np.arange(top.num_velocities) if top.analysis is None else np.asarray(top.analysis.independent, int)


def dependent_columns(system: System) -> np.ndarray:
    """The other velocity columns."""
    return np.setdiff1d(np.arange(system.topology.num_velocities), independent_columns(system))


def with_mobility(system: System, found: Mobility | None, length=None) -> System:
    """The system with a mobility in its topology and, where given, its characteristic length [m]."""
    system = dataclasses.replace(system, topology=dataclasses.replace(system.topology, analysis=found))
    return system if length is None else dataclasses.replace(system, length=as_array(length))


def _nearest_independent_set(Z, columns):
    """Velocity columns that determine every motion of the null space Z: of the given ones those that do so well,
    completed by pivoting."""
    kept: tuple[int, ...] = ()
    if columns:
        order, sizes = pivoted_columns(Z[list(columns)].T)
        kept = tuple(columns[k] for k in order[sizes > _SINGULAR_MOTION])
    missing = Z.shape[1] - len(kept)
    known = np.linalg.qr(Z[list(kept)].T)[0] if kept else np.zeros((Z.shape[1], 0))
    more = pivoted_columns(Z.T - known @ (known.T @ Z.T))[0][:missing]
    found = tuple(sorted([*kept, *(int(k) for k in more)]))
    return columns if set(found) == set(columns) else found


def _requested_independent_set(top: Topology, Z, wanted):
    """Velocity columns of the user's joints."""
    wanted = distinct_names("independent", wanted)
    unknown = [n for n in wanted if n not in top.joint_index]
    if unknown:
        raise ModelError([f"independent: {no_such('joint', n, top.joint_names)}" for n in unknown])
    columns = [k for n in wanted for k in range(*top.joints[top.joint_index[n]].velocities.indices(10**9))]
    # a set that is all but singular is the user's to choose
    if len(columns) != Z.shape[1] or np.linalg.svd(Z[columns], compute_uv=False)[-1] < 1e-9:
        raise ModelError(
            [
                f"independent: joints {', '.join(wanted)} give {len(columns)} velocities that do not determine "
                f"the motion; the mobility is {Z.shape[1]}"
            ]
        )
    return tuple(columns)


def _undetermined_components(carriers, B, Y, length):
    """Reaction components that a self-stress of redundant rows changes, and the carriers they belong to."""
    if Y.shape[1] == 0:
        return tuple((False,) * 6 for _ in carriers), ()
    change = np.abs(B @ Y) / np.r_[np.ones(3), np.full(3, length)][None, :, None]
    marks = change.max(axis=2) > 1e-6 * max(change.max(), 1e-3)  # rounding stays below, couplers change nothing
    flags = tuple(tuple(bool(m) for m in row) for row in marks)
    return flags, tuple(name for (name, *_), row in zip(carriers, flags, strict=True) if any(row))


def _self_stressed_rows(system, Y):
    """Names of couplers, drives and rows of the user that are in self-stresses Y (rows, redundant)."""
    own, shares = {name for group in system.rows for name in group.names}, np.abs(Y).max(axis=1, initial=0.0) > 1e-6
    return dict.fromkeys(
        name for name, part in zip(system.topology.row_joint, shares, strict=True) if part and name in own
    )
