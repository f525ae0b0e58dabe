"""The choice of a solver where none is named: by what the system is and by its slopes at the start, never by a clock.

An implicit solver pays where a motion that dies out fast would bound the steps of an explicit one long after it is
gone.  Fast motions that last, as lightly damped modes of elastic bodies, both must follow, and order eight does so in
fewer steps.  Whether some motion can die out that fast is told on the host from dampers and masses, which costs
nothing; only then the slopes of the rates are computed, with their eigenvalues, and the work of either solver.
"""

from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from ..checks import is_concrete
from ..friction._joint_friction import bristle_groups, without_friction
from ..kinematics._configuration import at_state
from ..model._changes import with_changes
from ..ode._options import RTOL, Options
from ..runtime import jit, not_tracing
from ..tables import format_number
from ._fastest_decay import fastest_decay
from ._options import class_of, follows_rows

#: Radius of the region of stability of Dopri8: its steps on a decay are this over the rate.
_RADIUS = 5.0
#: Steps below which an explicit solver has answered before an implicit one is traced: `solvers.py --first`.
_FEW_STEPS = 3000.0
#: A motion is gone after this part of the span, when it has lost nine digits.
_GONE, _DIGITS = 0.1, 20.0
#: Steps of Rodas5P for each radian of a motion that lasts, at a tolerance of 1e-9, and for the others at the start:
#: 13 to 34 in `benchmarks/solvers.py`, where Dopri8 takes 4 to 7.
_IMPLICIT_STEPS, _FIRST_STEPS, _EXPLICIT_STEPS = 30.0, 50.0, 6.0
#: Order of Rodas5P, by which its steps grow with smaller tolerances.
_ORDER = 5.0
#: Rates that a step evaluates: 12 stages of Dopri8; 8 of Rodas5P beside the slopes, half a rate for each unknown.
_EXPLICIT_RATES, _IMPLICIT_RATES = 12.0, 8.0
#: Unknowns from which the dense matrix of an implicit step costs more than its rates.
_MANY = 120


class Choice(NamedTuple):
    """A solver, None for Dopri8, and why it was chosen, empty where it was named."""

    solver: Any
    reason: str = ""

    def in_words(self, options: Options, formulation: Any) -> str:
        """The solver with its tolerances or its step, and why it was chosen."""
        words = options.in_words
        if follows_rows(formulation):
            words = f"the constraints alone give the motion, nothing is integrated but the work: {words}"
        return f"{words}; chosen as {self.reason}" if self.reason else words


def choose_solver(system: Any, state: Any, span: Any, landings: int, rtol: Any, formulation: Any) -> Choice:
    """The solver of a motion whose steps adapt: Rodas5P where its work is less, else Dopri8.

    Args: span: first and last time [s]; landings: number of times on which steps must end; rtol: of each step,
    None for the default.

    Within a trace, where numbers are not known, it is Dopri8.
    """
    if follows_rows(formulation):
        return Choice(None)
    if not not_tracing() or not is_concrete(system, state, span, rtol):
        return Choice(None, "within a trace no number is known")
    length = float(np.asarray(span[1]) - np.asarray(span[0]))
    if not _may_be_stiff(system, length):
        return Choice(None, "nothing dies out much faster than the motion lasts")
    unknowns = system.topology.num_coordinates + system.topology.num_velocities + system.topology.num_internal
    if unknowns > _MANY:
        return Choice(None, f"{unknowns} unknowns are many for an implicit solver")
    roots = _eigenvalues(system, state, formulation)
    relative = RTOL[state.coordinates.dtype.itemsize] if rtol is None else np.max(np.asarray(rtol))
    return _cheaper(roots, length, landings, float(relative), unknowns)


def _cheaper(roots: np.ndarray, length: float, landings: int, rtol: float, unknowns: int) -> Choice:
    """The solver of less work for a motion with these eigenvalues (n,) [1/s] of the slopes of its rates."""
    size = np.abs(roots)
    gone = -roots.real * _GONE * length > _DIGITS
    fastest = float(np.max(size, initial=0.0))
    lasting = length * float(np.max(size[~gone], initial=0.0))
    explicit = max(length * fastest / _RADIUS, _EXPLICIT_STEPS * lasting)
    finer = (1e-9 / max(rtol, 1e-15)) ** (1.0 / _ORDER)
    implicit = finer * (_FIRST_STEPS + _IMPLICIT_STEPS * lasting)
    words = f"the fastest motion at the start, {format_number(fastest)} 1/s,"
    if not size.size or not gone[np.argmax(size)]:
        return Choice(None, f"{words} lasts: both kinds of solver must follow it")
    work = max(explicit, landings) * _EXPLICIT_RATES, max(implicit, landings) * (_IMPLICIT_RATES + 0.5 * unknowns)
    if explicit < _FEW_STEPS or work[0] < work[1]:
        return Choice(None, f"{words} dies out, and bounds its steps too little for an implicit one")
    from ..ode._rosenbrock import Rodas5P

    return Choice(Rodas5P(), f"{words} dies out and would bound the steps of Dopri8 all along")


def _may_be_stiff(system: Any, length: float) -> bool:
    """True if something may die out so fast that the steps of an explicit solver are many; internal states of laws,
    whose rates are not known before they are computed, always may."""
    if any(group.internal for group in (*system.forces, *bristle_groups(system.friction))):
        return True
    return bool(length * fastest_decay(system) / _RADIUS > _FEW_STEPS)


def _eigenvalues(system: Any, state: Any, formulation: Any) -> np.ndarray:
    """Eigenvalues (n,) [1/s] of the slopes of the rates at a state; without friction of joints other than bristles,
    whose slopes are steep at rest alone.  Empty where they are not finite."""
    system = system if bristle_groups(system.friction) else without_friction(system)
    rates = np.asarray(_rates_around(system, state, formulation))
    slopes = (rates[1:] - rates[0]) / _difference_step(rates.dtype)
    return np.linalg.eigvals(slopes) if np.isfinite(slopes).all() else np.zeros(0)


def _difference_step(dtype) -> float:
    """Distance of points whose rates give slopes to half of the digits; unknowns are near one."""
    return float(np.sqrt(np.finfo(dtype).eps))


@jit(compile="tape")
def _rates_around(system, state, formulation):
    """Rates (1 + n, n) of coordinates, second half and internal states at a state, and beside it along each of them:
    differences are traced in a third of the time that derivatives are."""
    from ._formulation import num_powers

    system = with_changes(system, state)
    equations, p0 = class_of(formulation).begin(system, at_state(system, state), state.velocities, state.internal)
    start, no_work = jnp.concatenate([state.coordinates, p0]), jnp.zeros(num_powers(system), p0.dtype)
    n = state.coordinates.size

    def rates(step):
        x = start + step
        psi, p, _ = equations.rate(state.t, (x[:n], x[n:], no_work))
        return jnp.concatenate([psi, p])

    steps = np.concatenate([np.zeros((1, start.size)), _difference_step(start.dtype) * np.eye(start.size)])
    return lax.map(rates, jnp.asarray(steps, start.dtype))
