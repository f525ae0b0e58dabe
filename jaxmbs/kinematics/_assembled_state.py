"""How a state that is asked for is found: by a search on the host or within a trace, or along a branch."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array

from ..errors import AssemblyError
from ..model._system import System
from ..runtime import jit
from ._assembly import assembled
from ._branches import branch_signs
from ._continuation import Place, follow
from ._cut_joints import with_cut_values
from ._host_assembly import assembled_on_host
from ._host_rows import evaluate
from ._named_values import Request, coordinates_of, free_columns
from ._poses import node_parameters
from ._rank import constraint_rank

#: Residuals that count as closed, by precision.
CLOSED = {8: 1e-8, 4: 1e-3}
_RESTARTS = 12  # searches from other guesses before a state counts as impossible
_NEARLY = 1e-2  # residuals [m or rad] that rounded coordinates leave open
_NO_SLOPE = "; a row that is open without end has no finite value or slope there: begin elsewhere, by guess="
_ROUNDED = (
    "; they nearly close the loops, as rounded numbers do: hold as many as there are freedoms and give the others as "
    "guess=, State.at(system, crank=0.3, guess={...})"
)


class Found(NamedTuple):
    """Time, coordinates and velocities of a state, what it leaves open of the rows of positions and of velocities,
    the change of the rows' rank since the build, and the signs of the branch."""

    t: Array | np.ndarray
    coordinates: Array | np.ndarray
    velocities: Array | np.ndarray
    open: Array | np.ndarray
    open_rates: Array | np.ndarray
    rank_change: Array | np.ndarray
    branch: Array | np.ndarray

    @property
    def residual(self):
        """The largest of what is open (...)."""
        xp = np if isinstance(self.open, np.ndarray) else jnp
        return xp.max(xp.abs(xp.concatenate([self.open, self.open_rates], axis=-1)), axis=-1, initial=0.0)


def found_on_host(asked: Request) -> Found:
    """The state by a search on the host; one that fails starts again from random guesses.  Raises: AssemblyError."""
    system, u, free, restart = asked.system, asked.velocities, asked.free, not asked.has_guess
    t = np.asarray(asked.t, asked.coordinates.dtype)
    psi = _at_drives(asked, t)
    if asked.cut_guesses:
        psi = _search(with_cut_values(system, {**asked.cut_guesses, **asked.cuts}), psi, u, t, free, restart=True)[0]
    if asked.cuts:
        holding = with_cut_values(system, asked.cuts)
        psi, _, f, *_ = _search(holding, psi, u, t, free, restart)
        check_closed(holding, f, np.zeros(0, psi.dtype))
    psi, u, f, g, A = _search(system, psi, u, t, free, restart and not (asked.cuts or asked.cut_guesses))
    check_closed(system, f, g, asked.held)
    return Found(t, psi, u, f, g, *_signs(system, A, asked.held))


def found_in_trace(asked: Request) -> Found:
    """The state by a search within a trace."""
    system, (psi, u, t) = asked.system, map(jnp.asarray, asked.numbers[:3])
    for row in asked.drives:
        psi = psi.at[np.asarray(row.coordinates)].set(lax.stop_gradient(jnp.reshape(row.law(t), (1,))))
    if asked.cut_guesses:
        holding = with_cut_values(system, {**asked.cut_guesses, **asked.cuts})
        free, free_rates = map(jnp.asarray, asked.free)
        psi = lax.stop_gradient(assembled(holding, psi, u, t, free, free_rates)[0])
    return closed_at(system, psi, u, t, asked.held, asked.held_rates, asked.cuts)


@jit(compile="quick")
def found_along(system: System, psi, u, t, start: Place, columns, rate_columns, cuts) -> tuple[Found, Array, Place]:
    """The state on the branch of a place, the share () of the way there that could be gone, and the place."""
    holding = with_cut_values(system, cuts) if cuts else system
    fixed, P, begin, goal, end = constant((holding, node_parameters(system), start, psi, t))
    place, share = follow(fixed, P, begin, goal, end, columns)
    psi = jnp.where(coordinates_of(system.topology, columns), psi, place.psi)
    return closed_at(system, psi, u, t, columns, rate_columns, cuts, search=False), share, place


def closed_at(system: System, psi, u, t, columns, rate_columns, cuts, search: bool = True) -> Found:
    """The state near coordinates psi, or at them if none is to be searched, within a trace.

    NaN where it is not assembled: times NaN and not `where`, so that derivatives are NaN too.
    """
    free, free_rates = (jnp.asarray(free_columns(system.topology, x, psi.dtype)) for x in (columns, rate_columns))
    rows = [jnp.zeros(0, psi.dtype)]
    if cuts:
        psi, _, f, *_ = assembled(with_cut_values(system, cuts), psi, u, t, free, free_rates, search)
        rows.append(f)
    psi, u, f, g, A = assembled(system, psi, u, t, free, free_rates, search)
    left = lax.stop_gradient((jnp.concatenate([*rows, f]), g))
    found = Found(t, psi, u, *left, *_signs(system, A, columns))
    factor = jnp.where(found.residual <= CLOSED[psi.dtype.itemsize], 1.0, jnp.nan).astype(psi.dtype)
    return found._replace(coordinates=psi * factor, velocities=u * factor, branch=found.branch * factor)


def _signs(system, A, columns):
    """How the rank of the rows A differs from that of the build, and the signs of the branch."""
    rank, counted = constraint_rank(system, A), system.topology.analysis
    change = rank - (rank if counted is None else counted.rank)
    as_float = np.asarray(change, A.dtype) if isinstance(A, np.ndarray) else change.astype(A.dtype)
    return as_float, branch_signs(system, A, columns)


def constant(tree):
    """The tree as constants to derivatives."""
    return jax.tree.map(lambda x: lax.stop_gradient(x) if eqx.is_array(x) else x, tree)


def _at_drives(asked, t):
    """The coordinates that a search begins with: driven joints where they are driven to."""
    psi = np.array(asked.coordinates)
    if asked.drives:
        top = asked.system.topology
        names, f = np.array(top.row_joint, str)[top.position_rows], evaluate(asked.system, psi, t).f
        for row in asked.drives:
            psi[list(row.coordinates)] -= f[names == row.name]
    return psi


def _search(system, psi, u, t, free, restart):
    """Assemble from psi on the host; searches that fail start again from random guesses."""
    if not system.has_constraints:
        none = np.zeros(0, psi.dtype)
        return psi, u, none, none, np.zeros((0, len(u)), psi.dtype)
    found = assembled_on_host(system, psi, u, t, *free)
    # one seed: a state is a function of its arguments
    random, simple = np.random.default_rng(0), np.array([k != "ball" for k in system.topology.node_kind])
    columns = np.nonzero(simple)[0]
    index = np.asarray(system.topology.node_coordinate)[columns]
    for _ in range(_RESTARTS if restart else 0):
        if np.max(np.abs(found[2]), initial=0.0) < CLOSED[psi.dtype.itemsize]:
            break
        scale = np.where(system.topology.spins[columns] > 0, 1.0, np.asarray(system.length))
        start = np.array(psi)
        start[index] += random.normal(size=len(columns)) * scale * free[0][columns]
        found = assembled_on_host(system, start, u, t, *free)
    return found


def check_closed(system: System, f, g, columns=()) -> None:
    """AssemblyError when residuals remain, by the name of the joint or constraint; columns: whose coordinates are
    given."""
    top = system.topology
    for residual, rows, what, rounded in (
        (f, top.position_rows, "the mechanism cannot be assembled with the coordinates held", len(columns) > 0),
        (g, slice(None), "the velocities held contradict the constraints", False),
    ):
        closed = CLOSED[residual.dtype.itemsize]
        if np.all(np.abs(residual) < closed):
            continue
        worst: dict = {}
        for name, value in zip(np.array(top.row_joint)[rows], np.abs(residual), strict=True):
            if not value < closed:
                worst[name] = max(worst.get(name, 0.0), float(value) if np.isfinite(value) else np.inf)
        largest = max(worst.values())
        hint = _NO_SLOPE if largest == np.inf else _ROUNDED if rounded and largest < _NEARLY else ""
        raise AssemblyError(f"{what}{hint}; residual [m or rad] by joint:", worst)
