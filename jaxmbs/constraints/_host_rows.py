"""Constraint rows of a concrete system for searches on the host: one program for `build` and `State.at`."""

import dataclasses
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from ..checks import is_concrete
from ..kinematics._configuration import configuration
from ..kinematics._elastic import mass_matrix
from ..kinematics._poses import node_parameters, step_coordinates
from ..model._system import System
from ..runtime import jit, not_tracing
from . import _closures as closures
from . import _constraints as constraints
from ._reaction_map import reaction_map
from ._rounding import jacobian_without_rounding, residual_without_rounding
from ._sparse_rows import evaluate_sparse_rows


class RowEvaluation(NamedTuple):
    """Constraint rows at a pose, in NumPy: residual f, Jacobian A, rates f_t of the rows at rest, the map from the
    multipliers to reactions, the mass matrix M, and the frames' positions (frames, 3).  Entries of f and A that are
    rounding of their terms are zero.

    Where the system's linear solver is not dense, A is a sparse array of SciPy, and reactions and M have products.
    """

    f: np.ndarray
    A: Any
    f_t: np.ndarray
    reactions: Any
    M: Any
    positions: np.ndarray

    @property
    def is_finite(self) -> np.ndarray:
        """True (rows,) where a row has a slope."""
        return np.isfinite(abs(self.A).sum(axis=1))


@jit(compile="tape")
def _evaluation_program(system: System, psi, t):
    at = configuration(system, node_parameters(system), psi, t)
    parts, at = closures.residual_and_directions(system, at)
    f = residual_without_rounding(system, at, constraints.rows_together(system, at, parts))
    A = jacobian_without_rounding(system, at)
    return f, A, constraints.time_rate(system, at), reaction_map(system, at), mass_matrix(system, at), at.x


def evaluate_rows(system: System, psi, t) -> RowEvaluation:
    """Constraint rows of a concrete system; force elements and mobility are stripped so that they do not trigger
    recompilation."""
    bare = dataclasses.replace(
        system, topology=dataclasses.replace(system.topology, analysis=None, guess=()), forces=()
    )
    if system.topology.linear_solver != "dense":
        return RowEvaluation(*evaluate_sparse_rows(bare, psi, t))
    return RowEvaluation(*map(np.asarray, _evaluation_program(bare, psi, t)))


def runs_on_host(*trees) -> bool:
    """True if all numbers of the trees are concrete and no trace is active that would record operations on them."""
    return not_tracing() and is_concrete(trees)


_step_program = jit(compile="tape")(step_coordinates)


def step_on_host(topology, psi, delta):
    """`psi (+) delta` on the host."""
    if topology.is_simple:
        return (psi + delta).astype(psi.dtype)
    return np.asarray(_step_program(topology, jnp.asarray(psi), jnp.asarray(delta, psi.dtype)))
