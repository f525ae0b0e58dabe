"""Options of `simulate` for mechanisms and linear systems alike: solver, step sizes, tolerances, derivatives."""

import math
from typing import Any, NamedTuple

import diffrax
import equinox as eqx
import jax.numpy as jnp
import lineax
import numpy as np
import optimistix
from jax import Array

from ..checks import any_concrete, is_concrete
from ..runtime import as_array, as_host_array
from ..typing import ArrayLike
from ._events import check_condition
from ._gauss import Gauss4, ImplicitMidpoint
from ._linear_solver import SquareSolver
from ._problem import checkpoints_for
from ._rosenbrock import Rodas5P

#: Methods of diffrax whose memory is another state of the motion, not a slope that is evaluated anew after a jump.
_TWO_STATES = (diffrax.LeapfrogMidpoint, diffrax.ReversibleHeun)
GRADIENTS = ("reverse", "forward")
LOOPS = ("jaxmbs", "diffeqsolve")
#: Default relative tolerance of a step by the size of a number [bytes].  An explicit method of order 8 takes a third
#: more steps than for 1e-8, and differences of motions still have half of their digits as derivatives; in single
#: precision the root of the rounding, as smaller errors cannot be told from it.
RTOL = {8: 1e-9, 4: 3e-4}
MAX_EVENT_STEPS = 200  # further steps for an event among fixed ones: each retry halves the bracket or better


class Options(NamedTuple):
    """Checked options of an integration; numbers are arrays, so that other ones compile no new program.

    Attributes:
        solver, controller: of diffrax; the controller is None for the default.
        dt: fixed step, None for adaptive ones.
        gradient: derivative mode, "reverse" or "forward".
        lands_on_times: steps end on the saved times.
        checkpoints: of the adjoint.
        loop: "jaxmbs" or "diffeqsolve".
    """

    solver: diffrax.AbstractSolver
    controller: diffrax.AbstractStepSizeController | None
    dt: Array | None
    rtol: Array
    atol: Array
    gradient: str
    max_steps: Array
    lands_on_times: bool
    progress: bool
    checkpoints: int
    loop: str

    @property
    def in_words(self) -> str:
        """The solver with its tolerances or its step, as a sentence of a report; traced numbers are called that."""
        by = "fixed steps" if self.dt is not None else "steps that adapt"
        numbers = {"rtol": self.rtol, "atol": self.atol} if self.dt is None else {"dt": self.dt}
        said = (f"{name} = {_in_words(x)}" for name, x in numbers.items())
        return f"{type(self.solver).__name__}, {by}, {', '.join(said)}"


def _in_words(x):
    if not is_concrete(x):
        return "traced"
    return f"{float(x):.4g}" if np.ndim(x) == 0 else "one for each entry"


def solver_or_default(solver: Any) -> Any:
    """The solver, by default Dopri8: at a relative tolerance of 1e-9 order eight takes the fewest evaluations."""
    return diffrax.Dopri8() if solver is None else solver


def is_implicit(solver: Any) -> bool:
    """True for solvers that step over modes much faster than their steps."""
    return isinstance(solver, diffrax.AbstractImplicitSolver | Rodas5P | ImplicitMidpoint | Gauss4)


def check_options(
    solver: Any, controller: Any, dt: Any, rtol: Any, atol: Any, gradient: Any, loop: Any = LOOPS[0]
) -> None:
    """Raises: ValueError for options that are wrong or contradict each other."""
    if not isinstance(loop, str) or loop not in LOOPS:
        raise ValueError(f"loop={loop!r} must be one of {', '.join(LOOPS)}")
    if isinstance(gradient, diffrax.BacksolveAdjoint):
        raise ValueError("BacksolveAdjoint differentiates the motion without its projection: take gradient='reverse'")
    if not isinstance(gradient, str) or gradient not in GRADIENTS:
        raise ValueError(f"gradient={gradient!r} must be one of {', '.join(GRADIENTS)}")
    _check_solver(solver)
    if controller is not None and not isinstance(controller, diffrax.AbstractAdaptiveStepSizeController):
        raise ValueError(
            f"controller must be an adaptive one of diffrax, got {controller!r}; for fixed steps give dt="
        )
    for name, value in {"rtol": rtol, "atol": atol}.items():
        if value is not None and (np.iscomplexobj(value) or any_concrete(lambda x: ~np.isfinite(x) | (x < 0), value)):
            raise ValueError(f"{name}={value} must be finite and not negative")
    if controller is not None and dt is not None:
        raise ValueError("give dt= (fixed steps) or controller= (adaptive steps), not both")
    if dt is None and not isinstance(solver, diffrax.AbstractAdaptiveSolver):
        raise ValueError(f"{type(solver).__name__} has no error estimate: give dt=")


def _check_solver(solver):
    """Raises: ValueError unless it is a solver of diffrax for one ordinary differential equation."""
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


def check_event(event: Any, state: Any, example: str) -> None:
    """Raises: TypeError unless an event, if there is one, is a function of a state to one real number."""
    if event is None:
        return
    if isinstance(event, list | tuple | diffrax.Event) or not callable(event):
        raise TypeError(
            f"event= takes one function of a {type(state).__name__} whose zero ends the motion, such as "
            f"lambda s: {example}, not {type(event).__name__}; for the first of two that start positive: "
            "lambda s: jnp.minimum(f(s), g(s))"
        )
    check_condition(event, state)


def make_options(
    solver: Any,
    controller: Any,
    *,
    span: tuple[ArrayLike, ArrayLike],
    dt: ArrayLike | None,
    rtol: ArrayLike | None,
    atol: ArrayLike,
    gradient: str,
    max_steps: int,
    lands_on_times: bool,
    progress: bool,
    has_event: bool,
    max_actions: int = 0,
    loop: str = LOOPS[0],
    dtype: Any = float,
    periods: ArrayLike | None = None,
) -> Options:
    """The options, checked by `check_options`, as arrays of a type.

    Args:
        span: first and last time; with fixed steps their number bounds the steps.
        lands_on_times: for adaptive steps; fixed ones never do.
        periods: of samples (m,), at which fixed steps are cut.

    Raises: ValueError, if concrete, for a step that is not positive.
    """
    rtol = RTOL[jnp.dtype(jnp.result_type(dtype)).itemsize] if rtol is None else rtol
    if isinstance(solver, diffrax.AbstractImplicitSolver):
        solver = _with_root_finder(solver, dt, rtol, atol)
    steps = num_fixed_steps(*span, dt)
    if steps is not None:
        max_steps = steps + (MAX_EVENT_STEPS * (1 + max_actions) if has_event else 2) + _num_samples(*span, periods)
    step = None if dt is None else as_host_array(dt, dtype)
    tolerances = as_host_array(rtol, dtype), as_host_array(atol, dtype)
    limit = as_host_array(max_steps, np.int32)
    lands_on_times = lands_on_times and dt is None
    checkpoints = checkpoints_for(max_steps)
    return Options(
        solver, controller, step, *tolerances, gradient, limit, lands_on_times, progress, checkpoints, loop
    )


def num_fixed_steps(t0: ArrayLike, t1: ArrayLike, dt: ArrayLike | None) -> int | None:
    """Number of fixed steps, None where it is not known.  Raises: ValueError for a step that is not positive."""
    if dt is None or not is_concrete(t0, t1, dt):
        return None
    step = float(np.asarray(dt))
    if not (step > 0 and np.isfinite(step)):
        raise ValueError(f"dt must be positive, got {dt}")
    # the rounding of a ratio that should be a whole number makes no step of its own
    return max(1, math.ceil(float(np.asarray(t1) - np.asarray(t0)) / step - 1e-9))


def _num_samples(t0, t1, periods):
    """Bound on the number of samples; zero where it is not known."""
    if periods is None or not is_concrete(periods):
        return 0
    return int(np.sum(np.ceil(float(np.asarray(t1) - np.asarray(t0)) / np.asarray(periods)) + 1.0))


def _with_root_finder(solver, dt, rtol, atol):
    """The solver with our root finder for diffrax's default, and no batches for LAPACK (`runtime/_lapack.py`)."""
    finder = solver.root_finder
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
