"""Options of `simulate` for mechanisms and linear systems alike: solver, step sizes, tolerances, derivatives."""

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..checks import any_concrete, is_concrete, number_faults
from ..lazy import is_instance
from ..runtime import as_host_array
from ..typing import ArrayLike
from ._events import check_condition

if TYPE_CHECKING:
    import diffrax

GRADIENTS = ("reverse", "forward")
LOOPS = ("jaxmbs", "diffeqsolve")
#: Default relative tolerance of a step by the size of a number [bytes].  An explicit method of order 8 takes a third
#: more steps than for 1e-8, and differences of motions still have half of their digits as derivatives; in single
#: precision the root of the rounding, as smaller errors cannot be told from it.
RTOL = {8: 1e-9, 4: 3e-4}
MIN_CHECKPOINTS = 512  # two buffers of so many steps are small beside a program; motions of 262 144 steps fit them
MAX_EVENT_STEPS = 200  # further steps for an event among fixed ones: each retry halves the bracket or better


class Options(NamedTuple):
    """Checked options of an integration; numbers are arrays, so that other ones compile no new program.

    Attributes:
        solver, controller: of diffrax; None for the default, whose class is imported where a motion is traced.
        dt: fixed step, None for adaptive ones.
        gradient: derivative mode, "reverse" or "forward".
        lands_on_times: steps end on the saved times.
        checkpoints: of the adjoint.
        loop: "jaxmbs" or "diffeqsolve".
        longest_step: of adaptive ones, None for any.
    """

    solver: "diffrax.AbstractSolver | None"
    controller: "diffrax.AbstractStepSizeController | None"
    dt: Array | None
    rtol: Array
    atol: Array
    gradient: str
    max_steps: Array
    lands_on_times: bool
    progress: bool
    checkpoints: int
    loop: str
    longest_step: Array | None = None

    @property
    def in_words(self) -> str:
        """The solver with its tolerances or its step, as a sentence of a report; traced numbers are called that."""
        by = "fixed steps" if self.dt is not None else "steps that adapt"
        numbers = {"rtol": self.rtol, "atol": self.atol} if self.dt is None else {"dt": self.dt}
        said = (f"{name} = {_in_words(x)}" for name, x in numbers.items())
        return f"{name_of_solver(self.solver)}, {by}, {', '.join(said)}"


def _in_words(x):
    if not is_concrete(x):
        return "traced"
    return f"{float(x):.4g}" if np.ndim(x) == 0 else "one for each entry"


def solver_or_default(solver: Any) -> Any:
    """The solver, by default Dopri8: at a relative tolerance of 1e-9 order eight takes the fewest evaluations."""
    import diffrax

    return diffrax.Dopri8() if solver is None else solver


def name_of_solver(solver: Any) -> str:
    """The name of its class, as motions report it."""
    return "Dopri8" if solver is None else type(solver).__name__


def check_options(
    solver: Any,
    controller: Any,
    dt: Any,
    rtol: Any,
    atol: Any,
    gradient: Any,
    loop: Any = LOOPS[0],
    longest_step: Any = None,
) -> None:
    """Raises: ValueError for options that are wrong or contradict each other."""
    if not isinstance(loop, str) or loop not in LOOPS:
        raise ValueError(f"loop={loop!r} must be one of {', '.join(LOOPS)}")
    if is_instance(gradient, "diffrax", "BacksolveAdjoint"):
        raise ValueError("BacksolveAdjoint differentiates the motion without its projection: take gradient='reverse'")
    if not isinstance(gradient, str) or gradient not in GRADIENTS:
        raise ValueError(f"gradient={gradient!r} must be one of {', '.join(GRADIENTS)}")
    if solver is not None:
        from ._named_solver import check_solver  # with all of diffrax

        check_solver(solver, dt)
    if controller is not None and not is_instance(controller, "diffrax", "AbstractAdaptiveStepSizeController"):
        raise ValueError(
            f"controller must be an adaptive one of diffrax, got {controller!r}; for fixed steps give dt="
        )
    for name, value in {"rtol": rtol, "atol": atol}.items():
        if value is not None and (np.iscomplexobj(value) or any_concrete(lambda x: ~np.isfinite(x) | (x < 0), value)):
            raise ValueError(f"{name}={value} must be finite and not negative")
    if controller is not None and dt is not None:
        raise ValueError("give dt= (fixed steps) or controller= (adaptive steps), not both")
    if longest_step is None:
        return
    if faults := number_faults("longest_step", longest_step, positive=True):
        raise ValueError(faults[0])
    if controller is not None or dt is not None:
        raise ValueError("longest_step= bounds steps that adapt to rtol and atol: leave dt= and controller= out")


def check_event(event: Any, state: Any, example: str) -> None:
    """Raises: TypeError unless an event, if there is one, is a function of a state to one real number."""
    if event is None:
        return
    if isinstance(event, list | tuple) or is_instance(event, "diffrax", "Event") or not callable(event):
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
    longest_step: ArrayLike | None = None,
) -> Options:
    """The options, checked by `check_options`, as arrays of a type.

    Args:
        span: first and last time; with fixed steps their number bounds the steps.
        lands_on_times: for adaptive steps; fixed ones never do.
        periods: of samples (m,), at which fixed steps are cut.

    Raises: ValueError, if concrete, for a step that is not positive.
    """
    rtol = RTOL[jnp.dtype(jnp.result_type(dtype)).itemsize] if rtol is None else rtol
    if solver is not None:
        from ._named_solver import with_root_finder

        solver = with_root_finder(solver, dt, rtol, atol)
    steps = num_fixed_steps(*span, dt)
    if steps is not None:
        max_steps = steps + (MAX_EVENT_STEPS * (1 + max_actions) if has_event else 2) + _num_samples(*span, periods)
    step = None if dt is None else as_host_array(dt, dtype)
    tolerances = as_host_array(rtol, dtype), as_host_array(atol, dtype)
    limit = as_host_array(max_steps, np.int32)
    lands_on_times = lands_on_times and dt is None
    checkpoints = checkpoints_for(max_steps)
    longest = None if longest_step is None else as_host_array(longest_step, dtype)
    return Options(
        solver, controller, step, *tolerances, gradient, limit, lands_on_times, progress, checkpoints, loop, longest
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


def checkpoints_for(steps: int) -> int:
    """Checkpoints that the adjoint of so many steps needs: a power of two, so that few programs differ by it."""
    return max(MIN_CHECKPOINTS, 1 << math.ceil(math.log2(max(steps, 1)) / 2))
