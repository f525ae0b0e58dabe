"""Readings of diffrax's inside that no public name of it gives: its kinds of step, tableaux and dense output.

Relied upon (diffrax 0.7): a step of `AbstractERK` or `AbstractDIRK` returns as its dense output the ends `y0`, `y1`
and the increments `k = h f` of all stages; solvers with stages keep the kind of their loop in `scan_kind`; explicit
tableaux hold the rows `a_lower` below the diagonal and implicit ones `a_diagonal` beside it.  `tests/ode/
test_diffrax_internals.py` fails by name if one of these changes.
"""

from typing import Any, TypeVar

import diffrax
import equinox as eqx
import jax
import numpy as np
from jaxtyping import PyTree

Solver = TypeVar("Solver", bound=diffrax.AbstractSolver)


def has_explicit_stages(solver: diffrax.AbstractSolver) -> bool:
    """True for an explicit Runge-Kutta method with diffrax's own step, whose stages are in its dense output."""
    explicit = isinstance(solver, diffrax.AbstractERK) and isinstance(solver.tableau, diffrax.ButcherTableau)
    return explicit and type(solver).step is diffrax.AbstractERK.step


def is_diagonally_implicit(solver: diffrax.AbstractSolver) -> bool:
    """True for diffrax's own methods each of whose stages is implicit in itself alone."""
    if type(solver) is diffrax.ImplicitEuler:
        return True
    single = isinstance(solver, diffrax.AbstractDIRK) and isinstance(solver.tableau, diffrax.ButcherTableau)
    return single and type(solver).step is diffrax.AbstractDIRK.step


def with_scan_kind(solver: Solver, kind: str) -> Solver:
    """The solver with its loop over stages of a kind: "lax" has forward derivatives, "checkpointed" reverse ones."""
    if not hasattr(solver, "scan_kind"):
        return solver
    return eqx.tree_at(lambda s: s.scan_kind, solver, kind, is_leaf=lambda x: x is None)


def butcher_arrays(solver: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A (stages, stages), b and c of the stages `k_i = h f(t0 + c_i h, y0 + sum a_ij k_j)`."""
    if isinstance(solver, diffrax.ImplicitEuler):
        return np.ones((1, 1)), np.ones(1), np.ones(1)
    tableau = solver.tableau
    diagonal = getattr(tableau, "a_diagonal", None)
    A = np.zeros((tableau.num_stages,) * 2) if diagonal is None else np.diag(diagonal)
    for i, row in enumerate(tableau.a_lower):
        A[i + 1, : i + 1] = row
    return A, tableau.b_sol, np.r_[tableau.c1, tableau.c]


def stage_increments(solver: diffrax.AbstractSolver, dense: dict) -> PyTree:
    """The increments k (stages, ...) of a step, from its dense output."""
    if isinstance(solver, diffrax.ImplicitEuler):
        return jax.tree.map(lambda y0, y1: (y1 - y0)[None], dense["y0"], dense["y1"])
    return dense["k"]
