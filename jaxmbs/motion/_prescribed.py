"""Systems without freedom: whether a start belongs to them, counted where it is known."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..assembly._host_assembly import close_on_host, has_finite_rows
from ..assembly._state import State
from ..checks import is_concrete
from ..constraints._closures import with_directions
from ..constraints._host_rows import evaluate_rows, runs_on_host, step_on_host
from ..constraints._linear_rows import linear_rows
from ..constraints._mobility import row_spaces
from ..constraints._rank import constraint_rank
from ..constraints._rows import is_rheonomic
from ..errors import ModelError
from ..kinematics._configuration import at_state
from ..model._internal_states import replace_field
from ..model._system import System
from ..runtime import jit
from ..status import Status, succeeded
from ._motion import Motion

_STEP = 0.05  # [rad] to another pose of the same branch


def is_prescribed(system: System, state: State) -> bool:
    """True if no freedom is left at the pose of the build or at the start.

    A pose that has lost rank is singular, and what is driven through it stays driven; or its branch has a freedom
    that the branch of the build has not, as of three parallel cranks: then its neighbours have lost rank too.
    Within a trace that is not known, and what no drive moves may move by itself.
    """
    freedoms = system.topology.mobility
    known = state.rank_change.ndim == 0 and is_concrete(state.rank_change)
    gained = int(state.rank_change) if known else 0
    if not known and not is_rheonomic(system):
        return False
    if freedoms > 0 or gained >= 0 or not runs_on_host(system, state):
        return freedoms - max(gained, 0) <= 0
    return not _has_mobile_neighbour(system, np.asarray(state.coordinates), np.asarray(state.t))


def check_prescribed(system: System, state: State) -> None:
    """Raises: ModelError for a system with freedoms, whose rows leave its velocities open."""
    if is_concrete(state.rank_change) and state.rank_change.ndim == 0 and not is_prescribed(system, state):
        raise ModelError(
            [
                f'formulation="prescribed": the rows leave {max(system.topology.mobility, 1)} freedoms open; it is '
                'for systems without any, take "canonical" or leave it out'
            ],
            what="the motion",
        )


def with_freedoms_told(system: System, state: State, motion: Motion) -> Motion:
    """The motion without freedom, INCONSISTENT where its rows leave a freedom open at the start and whenever saved.

    For traces, in which `is_prescribed` cannot look: a pose that has lost rank alone is passed through, a branch with
    a freedom of its own keeps it, and velocities that no row gives would stay zero.
    """
    counted, change = system.topology.analysis, state.rank_change
    if runs_on_host(system, state) or counted is None or (is_concrete(change) and np.all(np.asarray(change) >= 0)):
        return motion
    along = jax.vmap(lambda state: _rank(system, state))(motion.states)
    is_open = (change < 0) & jnp.all(along < counted.rank) & (_rank(system, motion.end) < counted.rank)
    code = jnp.where(is_open & succeeded(motion.result), Status.INCONSISTENT, motion.result)
    return replace_field(motion, "result", code)


@jit
def _rank(system: System, state: State) -> Array:
    """Rank () of the rows at a state."""
    at = with_directions(system, at_state(system, state))
    return constraint_rank(system, linear_rows(system, at, jnp.ones_like(state.velocities)).for_ranks)


def _has_mobile_neighbour(system, psi, t):
    """True if a closed pose that is reached along the freedom at psi (nq,) has it too."""
    rank, Z, _ = row_spaces(system, evaluate_rows(system, psi, t))
    move = Z @ np.random.default_rng(0).normal(size=Z.shape[1])
    move *= _STEP / np.max(np.abs(move), initial=1e-12)
    there, rows = close_on_host(system, step_on_host(system.topology, psi, move), t, np.ones(len(move)))
    has_moved = np.max(np.abs(there - psi)) > _STEP / 2
    return has_moved and has_finite_rows(rows) and row_spaces(system, rows)[0] <= rank
