"""Assembled states: a requested state found by a search on the host, within a trace, or by following a branch."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array

from ..constraints._host_rows import evaluate_rows
from ..constraints._linear_rows import rows_of_numbers
from ..constraints._rank import constraint_rank
from ..constraints._rows import follow_drives
from ..constraints._saddle_operator import stop_gradients
from ..errors import AssemblyError
from ..kinematics._poses import node_parameters
from ..model._rows import drives
from ..model._system import System
from ..runtime import jit
from ._assembly import assemble_in_trace
from ._branch_following import BranchPoint, follow_branch
from ._branches import branch_signs
from ._cut_joints import with_cut_values
from ._host_assembly import assemble_on_host
from ._levenberg_marquardt import CLOSED_RESIDUAL, STATE_RESTARTS
from ._named_values import StateRequest, coordinate_mask, free_column_mask

_ROUNDED_RESIDUAL = 1e-2  # residuals [m or rad] that rounded coordinates leave open
_NO_SLOPE_HINT = (
    "; an infinite residual belongs to a row without a finite value or slope there: begin elsewhere, by guess="
)
_ROUNDED_HINT = (
    "; they nearly close the loops, as rounded numbers do: give as many as there are freedoms and the others as "
    "guess=, State.at(system, crank=0.3, guess={...})"
)


class AssembledState(NamedTuple):
    """Coordinates and velocities found for a request, with what is known of them.

    Attributes:
        t, coordinates, velocities: (), (nq,), (nv,).
        open, open_rates: residuals of the rows of position, those that prescribe cut joints first, and of velocity.
        rank_change: rank () of the rows here less that counted by the build.
        branch: signs (blocks,) of the branch.
    """

    t: Array | np.ndarray
    coordinates: Array | np.ndarray
    velocities: Array | np.ndarray
    open: Array | np.ndarray
    open_rates: Array | np.ndarray
    rank_change: Array | np.ndarray
    branch: Array | np.ndarray

    @property
    def residual(self):
        """Largest residual (...) of both kinds of rows."""
        xp = np if isinstance(self.open, np.ndarray) else jnp
        return xp.max(xp.abs(xp.concatenate([self.open, self.open_rates], axis=-1)), axis=-1, initial=0.0)


def find_on_host(asked: StateRequest) -> AssembledState:
    """The state by a search on the host; one that fails starts again from random guesses.  Raises: AssemblyError."""
    system, u, free, restart = asked.system, asked.velocities, asked.free, not asked.has_guess
    t = np.asarray(asked.t, asked.coordinates.dtype)
    psi = _start_coordinates(asked, t)
    if asked.cut_guesses:
        guessed = with_cut_values(system, {**asked.cut_guesses, **asked.cuts})
        psi = _search_with_restarts(guessed, psi, u, t, free, True)[0]
    if asked.cuts:
        holding = with_cut_values(system, asked.cuts)
        psi, _, f, *_ = _search_with_restarts(holding, psi, u, t, free, restart)
        check_closed(holding, f, np.zeros(0, psi.dtype))
    psi, u, f, g, A = _search_with_restarts(
        system, psi, u, t, free, restart and not (asked.cuts or asked.cut_guesses)
    )
    check_closed(system, f, g, asked.held)
    return AssembledState(t, psi, u, f, g, *_rank_and_branch(system, A, asked.held))


def find_in_trace(asked: StateRequest) -> AssembledState:
    """The state by a search within a trace."""
    system, (psi, u, t) = asked.system, map(jnp.asarray, asked.numbers[:3])
    psi = follow_drives(system, psi, t, asked.drives)
    if asked.cut_guesses:
        holding = with_cut_values(system, {**asked.cut_guesses, **asked.cuts})
        free, free_rates = map(jnp.asarray, asked.free)
        psi = lax.stop_gradient(assemble_in_trace(holding, psi, u, t, free, free_rates)[0])
    return close_state(system, psi, u, t, asked.held, asked.held_rates, asked.cuts)


@jit(compile="tape")
def find_on_branch(
    system: System, psi, u, t, start: BranchPoint, columns, rate_columns, cuts
) -> tuple[AssembledState, Array, BranchPoint]:
    """The state on the branch of a place, the share () of the way there that could be gone, and the place."""
    holding = with_cut_values(system, cuts) if cuts else system
    fixed, P, begin, goal, end = stop_gradients((holding, node_parameters(system), start, psi, t))
    place, share = follow_branch(fixed, P, begin, goal, end, columns)
    psi = jnp.where(coordinate_mask(system.topology, columns), psi, place.psi)
    return close_state(system, psi, u, t, columns, rate_columns, cuts, search=False), share, place


def close_state(system: System, psi, u, t, columns, rate_columns, cuts, search: bool = True) -> AssembledState:
    """The state near coordinates psi, or at them if none is to be searched, within a trace.

    NaN where it is not assembled: times NaN and not `where`, so that derivatives are NaN too.
    """
    free, free_rates = (jnp.asarray(free_column_mask(system.topology, x, psi.dtype)) for x in (columns, rate_columns))
    rows = [jnp.zeros(0, psi.dtype)]
    if cuts:
        psi, _, f, *_ = assemble_in_trace(with_cut_values(system, cuts), psi, u, t, free, free_rates, search)
        rows.append(f)
    psi, u, f, g, numbers = assemble_in_trace(system, psi, u, t, free, free_rates, search)
    every = rows_of_numbers(system, numbers, jnp.ones_like(u), np.arange(system.topology.num_rows))
    left = lax.stop_gradient((jnp.concatenate([*rows, f]), g))
    found = AssembledState(t, psi, u, *left, *_rank_and_branch_at_once(system, every.for_ranks, columns))
    factor = jnp.where(found.residual <= CLOSED_RESIDUAL[psi.dtype.itemsize], 1.0, jnp.nan).astype(psi.dtype)
    return found._replace(coordinates=psi * factor, velocities=u * factor, branch=found.branch * factor)


def _rank_and_branch(system, A, columns):
    """Difference of the rank of the rows A from that of the build, and the signs of the branch.

    Args: A: a matrix, dense or sparse, or `FrontalRows`.
    """
    rank, counted = constraint_rank(system, A), system.topology.analysis
    change = rank - (rank if counted is None else counted.rank)
    signs = branch_signs(system, A, columns)
    return np.asarray(change, signs.dtype) if isinstance(rank, int) else change.astype(signs.dtype), signs


#: One program, where a derivative of the user's would run it operation by operation.
_rank_and_branch_at_once = jit(_rank_and_branch, compile="tape")


def _start_coordinates(asked, t):
    """Coordinates that a search begins with: driven joints have the values of their drives at the time."""
    psi = np.array(asked.coordinates)
    if asked.drives:
        top = asked.system.topology
        f = np.zeros(top.num_rows)
        f[top.position_rows] = evaluate_rows(asked.system, psi, t).f
        for row in drives(asked.system.rows):
            if row.name in asked.drives:
                psi[list(row.coordinates)] -= f[list(row.places)]
    return psi


def _search_with_restarts(system, psi, u, t, free, restarts):
    """`assemble_on_host` from psi, for systems with or without constraints."""
    if not system.has_constraints:
        none = np.zeros(0, psi.dtype)
        return psi, u, none, none, np.zeros((0, len(u)), psi.dtype)
    return assemble_on_host(system, psi, u, t, *free, STATE_RESTARTS if restarts else 0)


def check_closed(system: System, f, g, columns=()) -> None:
    """Raises: AssemblyError where residuals remain, by the name of the joint or constraint.

    Args: columns: velocity columns whose coordinates are given.
    """
    top = system.topology
    for residual, rows, what, rounded in (
        (f, top.position_rows, "the mechanism cannot be assembled with the given coordinates", len(columns) > 0),
        (g, slice(None), "the given velocities contradict the constraints", False),
    ):
        closed = CLOSED_RESIDUAL[residual.dtype.itemsize]
        if np.all(np.abs(residual) < closed):
            continue
        worst: dict = {}
        for name, value in zip(np.array(top.row_joint)[rows], np.abs(residual), strict=True):
            if not value < closed:
                worst[name] = max(worst.get(name, 0.0), float(value) if np.isfinite(value) else np.inf)
        largest = max(worst.values())
        hint = (
            _NO_SLOPE_HINT if largest == np.inf else _ROUNDED_HINT if rounded and largest < _ROUNDED_RESIDUAL else ""
        )
        raise AssemblyError(f"{what}{hint}; residual [m or rad] by joint:", worst)
