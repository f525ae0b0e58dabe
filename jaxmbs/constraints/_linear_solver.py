"""The solver for the saddle systems of a mechanism, chosen at build by the size of the system and its front."""

import dataclasses

from ..errors import ModelError
from ..model._system import System
from ..runtime import tuning
from ._frontal_plan import frontal_plan
from ._saddle_operator import row_kinds

SOLVERS = ("auto", "dense", "frontal", "multifrontal")


def with_linear_solver(system: System, solver: str) -> System:
    """The system with the solver asked for, or for "auto" the fastest.

    Small systems are dense.  Larger ones take the front where it is narrow and no body deforms, and the multifrontal
    factor else.

    Raises: ModelError for an unknown solver, and for "frontal" where bodies deform.
    """
    if solver not in SOLVERS:
        raise ModelError([f"linear_solver must be one of {', '.join(map(repr, SOLVERS))}, got {solver!r}"])
    if solver == "frontal" and system.elastic:
        raise ModelError(["linear_solver='frontal' is for rigid bodies; take 'multifrontal' for elastic ones"])
    if solver == "auto":
        sparse = _block_sparse(system)
        pays = _frontal_pays if sparse == "frontal" else _factor_pays
        solver = sparse if system.has_constraints and pays(system.topology) else "dense"
    return dataclasses.replace(system, topology=dataclasses.replace(system.topology, linear_solver=solver))


def _frontal_pays(top):
    """Dense matrices cost by the cube of velocities and rows, fronts by the number of bodies."""
    size = top.num_velocities
    return size >= tuning.MANY_VELOCITIES or (
        size >= tuning.FRONTAL_VELOCITIES and top.num_rows >= tuning.FRONTAL_ROWS
    )


def _factor_pays(top):
    return top.num_velocities >= tuning.MULTIFRONTAL_VELOCITIES


def linear_solver(system: System) -> str:
    """ "dense", "frontal" or "multifrontal"."""
    return system.topology.linear_solver


def solver_for(system: System, method: str) -> str:
    """The solver for a `method`: one of `SOLVERS`, or "block-sparse", which is "frontal" or "multifrontal".

    Raises: ValueError for any other, and for "frontal" where bodies deform.
    """
    if method not in (*SOLVERS, "block-sparse"):
        names = ", ".join(map(repr, (*SOLVERS, "block-sparse")))
        raise ValueError(f"method must be one of {names}, got {method!r}")
    if method == "frontal" and system.elastic:
        raise ValueError(
            "method='frontal' is for rigid bodies; take 'multifrontal' or 'block-sparse' for elastic ones"
        )
    if not system.topology.num_velocities:  # a structure of welds has rows, and nothing to factor
        return "dense"
    if method == "block-sparse":
        return _block_sparse(system)
    return linear_solver(system) if method == "auto" else method


def _block_sparse(system):
    """ "frontal" where no body deforms, few rows read any column and the front is narrow, else "multifrontal"."""
    is_local = not system.elastic and len(row_kinds(system).others) <= tuning.BORDER_ROWS
    return "frontal" if is_local and frontal_plan(system).width <= tuning.FRONT_WIDTH else "multifrontal"
