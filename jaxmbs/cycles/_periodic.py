"""`periodic`: the periodic motion of a mechanism near a state, by multiple shooting."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from ..assembly._state import State
from ..checks import as_flag, is_concrete
from ..errors import SimulationError, warn
from ..math._nan import nan_slope_where, nan_where
from ..model._entry_points import check_system
from ..model._system import System
from ..motion._event import EventLike
from ..motion._formulation import Formulation
from ..motion._motion import Motion
from ..ode._loop import stop_gradients
from ..ode._options import solver_or_default
from ..runtime import as_array, as_host_array, jit, note
from ..signal_flow._sampling import sample_periods
from ..status import Status, succeeded
from ..typing import ArrayLike, WordedError
from ._arguments import check_choices, check_samples, first_state, make_shooting
from ._cycle import Cycle
from ._flow import Flow
from ._implicit import Solution, solution
from ._multipliers import multipliers_of
from ._shooting import Shooting
from ._whole import motion_of_segments, parts_of, repeats, residuals, size_of_motion

#: Default tolerances of the steps: multipliers and periods are then right to ten digits.
_TOLERANCE = {8: 1e-11, 4: 3e-5}
#: Residuals over the size of the motion up to which a motion is a cycle, of states and of rates.
_CLOSED, _CLOSED_RATES = {8: 1e-6, 4: 1e-2}, {8: 1e-5, 4: 5e-2}
#: Period, of the first guess, and size, of the system: a free period that leads below them leads to a state of rest.
_LEAST_PERIOD, _REST = 1e-3, 1e-6


def periodic(
    system: System,
    period: ArrayLike | None = None,
    start: WordedError[State | Motion | None] = None,
    free: str | None = None,
    segments: WordedError[int] = 1,
    periods: WordedError[int] = 1,
    turns: WordedError[Mapping[str, int] | None] = None,
    held: WordedError[Sequence[str]] = (),
    settle: WordedError[int] = 0,
    steps: WordedError[int] = 120,
    solver: Any = None,
    rtol: ArrayLike | None = None,
    atol: ArrayLike | None = None,
    gradient: str = "reverse",
    formulation: str | type[Formulation] | None = None,
    event: WordedError[EventLike | None] = None,
    max_steps: int = 100_000,
    throw: bool = True,
) -> Cycle:
    """The periodic motion near a state, with its loads, its stability and its derivatives.

    Args:
        period: [s] of the drives and forces; a first guess where the period is free.
        start: a state near the cycle (default: `State.at(system)`), or a motion or cycle over a period near it.
        free: "period" where the machine itself makes it: an oscillation, an engine's turn.
        segments: of the multiple shooting, more for motions that are unstable or sensitive.
        periods: number of periods until the motion repeats, of subharmonics.
        turns: joint -> turns that its coordinate gains over the whole cycle.  Angles in loops and of drives count
            modulo a turn by themselves; those of other joints must come back where they are not named here.
        held: names of coordinates "pin", velocities "rate of pin" and internal states that keep their value of the
            start: what fixes the phase of a free period (default: the first of `turns`, else steps across the
            motion), and of motions without losses, of which there is a family, the amplitude as well.
        settle: periods that are simulated first, from the start on.
        steps: equal intervals at whose ends states are saved, at least.
        solver, formulation, event, max_steps: as of `simulate`.  Events that act need one segment.
        rtol, atol: tolerances of each step, default 1e-11.
        gradient: derivative mode, "reverse" or "forward".
        throw: raise when none is found (outside of tracing); else look at `status`.

    Newton's method with a line search on the states at the begins of all segments, in as many numbers as the
    mechanism has freedoms.  First and second derivatives by the implicit function theorem, of states, loads and
    period, the first ones of single multipliers.  Sampled blocks need a period that theirs divide, by segments too.

    Returns: a Cycle.  Where none is found its numbers are NaN, and `status` says so.

    Raises:
        ModelError: unknown names, counts that are none, options that contradict each other.
        SimulationError: no cycle was found near the start, or drives and forces do not have the period; carries what
            was computed as `.motion`.
    Source: Seydel, Practical bifurcation and stability analysis (2010), chapter 7.
    """
    check_system(system)
    throw, counts = as_flag("throw", throw), {"segments": (segments, 1), "periods": (periods, 1), "steps": (steps, 1)}
    check_choices(period, free, gradient, event, counts | {"settle": (settle, 0)})
    begin = first_state(system, start)
    options = CycleOptions(turns, held, free is not None, segments, steps)
    flow = flow_of(begin, solver, rtol, atol, event, formulation, max_steps)
    period = as_array(0.0 if period is None else period).astype(begin.coordinates.dtype) * periods
    problem = problem_of(system, begin, flow, period, options)
    begin = start if isinstance(start, Motion) else begin
    found = _solve(system, problem, begin, period, settle, gradient)
    return _with_verdict(found, throw, options.is_free or int(periods) > 1)


class CycleOptions(NamedTuple):
    """Arguments of `periodic` that say what a cycle is."""

    turns: Mapping[str, int] | None
    held: Sequence[str]
    is_free: bool
    segments: int
    steps: int


class CycleProblem(NamedTuple):
    """The equations of a cycle, in how many parts its multipliers are found, and how many intervals are saved."""

    shooting: Shooting
    parts: int
    steps: int


def flow_of(state: State, solver, rtol, atol, event, formulation, max_steps) -> Flow:
    """The flow with the options of `periodic`, in the precision of a state."""
    dtype = state.coordinates.dtype
    rtol, atol = (as_host_array(_TOLERANCE[dtype.itemsize] if x is None else x, dtype) for x in (rtol, atol))
    return Flow(solver_or_default(solver), rtol, atol, event, formulation, max_steps)


def problem_of(system: System, begin: State, flow: Flow, period: Array, options: CycleOptions) -> CycleProblem:
    """The equations of a cycle near a state.  Raises: ModelError."""
    turns, held, is_free, segments, steps = options
    check_samples(system, period, segments, is_free)
    shooting = make_shooting(system, begin, flow, turns, held, is_free, segments)
    parts = parts_of(segments, flow.event is not None or sample_periods(system) is not None)
    return CycleProblem(shooting, parts, -(-steps // parts) * parts)


def _with_verdict(cycle, throw, is_shortest):
    """The cycle.  Raises: SimulationError where none was found, if it shall throw; warns of derivatives that it has
    not, and of one that repeats within its period where the shortest is meant."""
    note(lambda: cycle.result)
    if not is_concrete(cycle) or cycle.result.ndim:
        return cycle
    if throw and not bool(cycle.ok):
        raise SimulationError(_failure(cycle), cycle)
    if bool(cycle.ok) and bool(cycle.is_singular):
        warn(
            "periodic: a multiplier is 1: the cycle is one of many, or at a fold, and has no derivatives (they are "
            'NaN); an oscillation without a period of its own takes free="period", one without losses held= too'
        )
    elif bool(cycle.ok) and bool(jnp.any(jnp.isnan(cycle.multipliers))):
        warn(f"periodic: small deviations are too quick for the steps, the multipliers are not known: {_SHORTER}")
    if is_shortest and bool(cycle.ok) and int(cycle.repeats) > 1:
        warn(
            f"periodic: the motion repeats {int(cycle.repeats)} times within {float(cycle.period):.6g} s: it is a "
            "cycle of a part of that, and multipliers are those of the whole"
        )
    return cycle


_SHORTER = "save more states (steps=), so that steps are shorter, or take solver=jaxmbs.ode.Rodas5P()"


def _failure(cycle):
    """Words for a search that found no cycle."""
    if cycle.status != Status.NO_CYCLE:
        return f"the motion over the period failed: {cycle.status}"
    size = cycle.residual.dtype.itemsize
    closed, same = float(cycle.residual) <= _CLOSED[size], float(cycle.rate_residual) <= _CLOSED_RATES[size]
    if closed and same and cycle.num_trivial == 0:
        return (
            "the motion comes back, but its slopes are not finite: small deviations are too quick for the steps; "
            + _SHORTER
        )
    if closed and same:
        return "the search for a cycle with a period of its own ended at a state of rest; start from a livelier state"
    if closed:
        return (
            "there is a motion that comes back after the period, but its accelerations do not: drives or forces have "
            "another period; give theirs, or a multiple of it"
        )
    return (
        "no periodic motion was found near the start: where the search ended, the motion misses its begin by "
        f"{float(cycle.residual):.3g} of its size; start from a state, or a motion, that is closer, simulate some "
        "periods first (settle=), or divide the period (segments=)"
    )


@jit
def _solve(system, problem, start, period, settle, gradient):
    shooting = problem.shooting
    states = stop_gradients(_guess(system, shooting, start, period, settle))
    found = solution(shooting, system, (states, period), gradient, problem.steps // shooting.segments)
    return cycle_of(system, problem, found, period, gradient)


def cycle_of(system: System, problem: CycleProblem, found: Solution, period: Array, gradient: str) -> Cycle:
    """The cycle of states at the begins of its segments.  Args: period: [s] of the first guess."""
    shooting, parts, steps = problem
    motion = motion_of_segments(shooting, system, found.states, found.period, steps // shooting.segments, gradient)
    moving = shooting, system, motion, found.period
    multipliers = multipliers_of(*moving, parts, gradient)
    gaps, rates = stop_gradients(residuals(shooting, system, motion, found.period))
    trivial = shooting.held.number if shooting.is_free else 0
    is_singular = found.is_singular
    size = gaps.dtype.itemsize
    closed = found.found & (gaps <= _CLOSED[size]) & (rates <= _CLOSED_RATES[size])
    if shooting.is_free:
        moves = size_of_motion(motion, found.period) > _REST * system.length
        closed = closed & moves & (found.period > _LEAST_PERIOD * period)
    loss = _Loss(~closed, is_singular | ~closed)
    failed = (succeeded(motion.result) & ~closed) | (~found.found & (motion.result != Status.NOT_ASSEMBLED))
    fields = {field.name: getattr(motion, field.name) for field in dataclasses.fields(Motion)}
    fields |= {name: loss.numbers(fields[name]) for name in ("states", "diagnostics", "end")}
    fields |= {"ts": loss.slopes(motion.ts), "result": jnp.where(failed, Status.NO_CYCLE, motion.result)}
    return Cycle(
        **fields,
        period=loss.numbers(found.period),
        multipliers=loss.numbers(multipliers),
        residual=gaps,
        rate_residual=rates,
        is_singular=is_singular,
        repeats=stop_gradients(repeats(shooting, system, motion, found.period)),
        num_trivial=trivial,
        segments=shooting.segments,
    )


class _Loss(NamedTuple):
    """Marks () of a cycle whose numbers, or derivatives, are lost: NaN stands for them."""

    no_numbers: Array
    no_slopes: Array

    def slopes(self, tree):
        return jax.tree.map(lambda x: nan_slope_where(self.no_slopes, x) if _has_slope(x) else x, tree)

    def numbers(self, tree):
        return jax.tree.map(lambda x: nan_where(self.no_numbers, x) if _has_slope(x) else x, self.slopes(tree))


def _has_slope(x):
    return jnp.issubdtype(x.dtype, jnp.inexact)


def _guess(system, shooting, start, period, settle):
    """States (m,) at the begins of the segments."""
    times = shooting.times(period)
    if isinstance(start, Motion):
        span = start.ts[-1] - start.ts[0]
        there = start.at(system, start.ts[0] + span * (times[:-1] - times[0]) / period)
        return dataclasses.replace(there, t=times[:-1])
    if settle:
        late = shooting.flow.end(system, start, times[0] + settle * period)
        start = State(times[0], late.coordinates, late.velocities, structure=late.structure, internal=late.internal)
    if shooting.segments == 1:
        return jax.tree.map(lambda x: x[None], _bare(start))
    return _bare(shooting.flow.motion(system, start, times[:-1]).states)


def _bare(state):
    """A state as motions have them: without what assembly says of it."""
    return State(state.t, state.coordinates, state.velocities, structure=state.structure, internal=state.internal)
