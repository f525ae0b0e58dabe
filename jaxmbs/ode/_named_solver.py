"""Solvers that were named: which kinds there are, what cannot go with them, and their root finders."""

from typing import Any

import diffrax
import equinox as eqx
import lineax
import optimistix

from ..runtime import as_array
from ._gauss import Gauss4, ImplicitMidpoint
from ._linear_solver import SquareSolver
from ._rosenbrock import Rodas5P
from ._semi_implicit_euler import SemiImplicitEuler

#: Methods of diffrax whose memory is another state of the motion, not a slope that is evaluated anew after a jump.
_TWO_STATES = (diffrax.LeapfrogMidpoint, diffrax.ReversibleHeun)


def is_implicit(solver: Any) -> bool:
    """True for solvers that step over modes much faster than their steps."""
    return isinstance(solver, diffrax.AbstractImplicitSolver | Rodas5P | ImplicitMidpoint | Gauss4)


def is_semi_implicit(solver: Any) -> bool:
    """True for the solver that needs velocities beside coordinates."""
    return isinstance(solver, SemiImplicitEuler)


def check_solver(solver: Any, dt: Any) -> None:
    """Raises: ValueError unless it is a solver of diffrax for one ordinary differential equation, at fixed steps or
    with an estimate of its error."""
    if not isinstance(solver, diffrax.AbstractSolver):
        raise ValueError(f"solver must be a diffrax solver such as diffrax.Dopri8(), got {solver!r}")
    if isinstance(solver, diffrax.SemiImplicitEuler):
        raise ValueError(
            "diffrax.SemiImplicitEuler() splits two equations: give jaxmbs.ode.SemiImplicitEuler(), and dt="
        )
    if solver.term_structure is not diffrax.AbstractTerm:
        raise ValueError(
            f"{type(solver).__name__} is for stochastic or split equations; give a solver for ordinary ones, "
            "such as diffrax.Dopri8() or, if stiff, jaxmbs.ode.Rodas5P()"
        )
    if dt is None and not isinstance(solver, diffrax.AbstractAdaptiveSolver):
        raise ValueError(f"{type(solver).__name__} has no error estimate: give dt=")


def check_memory(solver: Any, why: str) -> None:
    """Raises: ValueError for a solver with a second state of its own, where that of the motion is moved.

    Args: why: what moves it.
    """
    inner = solver.solver if isinstance(solver, diffrax.HalfSolver) else solver
    if isinstance(inner, _TWO_STATES):
        raise ValueError(
            f"{type(inner).__name__} keeps a second state from step to step, which {why} would not move: take "
            "diffrax.Midpoint() or another one-step method"
        )


def with_root_finder(solver: Any, dt: Any, rtol: Any, atol: Any) -> Any:
    """The solver; an implicit one with our root finder for diffrax's default, and no batches for LAPACK
    (`runtime/_lapack.py`)."""
    if not isinstance(solver, diffrax.AbstractImplicitSolver):
        return solver
    finder: Any = solver.root_finder
    if isinstance(finder, diffrax.VeryChord):
        return eqx.tree_at(lambda s: s.root_finder, solver, _newton(dt, rtol, atol))
    if isinstance(getattr(finder, "linear_solver", None), lineax.AutoLinearSolver):
        return eqx.tree_at(lambda s: s.root_finder.linear_solver, solver, SquareSolver())
    return solver


def _newton(dt, rtol, atol):
    """Newton with a fresh Jacobian; diffrax's default fails at every second step of IFToMM's benchmark A05."""
    if dt is not None:
        tolerances = {"rtol": as_array(rtol), "atol": as_array(atol)}  # arrays: no new program
        return optimistix.Newton(**tolerances, linear_solver=SquareSolver())
    return diffrax.with_stepsize_controller_tols(optimistix.Newton)(linear_solver=SquareSolver())


def with_tolerances(solver: Any, controller: Any) -> Any:
    """The solver, its root finder with the controller's tolerances where it has none of its own.

    Raises: ValueError where steps are fixed and the root finder has none.
    """
    if not isinstance(solver, diffrax.AbstractImplicitSolver):
        return solver
    finder: Any = solver.root_finder
    values = {name: getattr(finder, name) for name in ("rtol", "atol", "norm")}
    missing = [name for name, value in values.items() if not (eqx.is_array_like(value) or callable(value))]
    if missing and not isinstance(controller, diffrax.AbstractAdaptiveStepSizeController):
        raise ValueError(f"{type(solver).__name__} at fixed steps needs a root finder with tolerances of its own")
    found = [getattr(controller, name) for name in missing]
    return eqx.tree_at(lambda s: [getattr(s.root_finder, name) for name in missing], solver, found)
