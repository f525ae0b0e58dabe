"""Integration of the equations of either noun by checked options, and what its end and its saved rows are."""

import functools
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix
from jax import Array, lax
from jaxtyping import PyTree

from ..math._nan import masked, value_where
from ..runtime import FORWARD_MODE, ON_TAPE, jit, reverse_only
from ..status import Status
from ._adjoint import integrate_with_adjoint
from ._corners import CornerController
from ._diffeqsolve import integrate_by_diffeqsolve
from ._events import Events
from ._loop import integrate, stop_gradients
from ._named_solver import with_tolerances
from ._options import Options, solver_or_default
from ._problem import LoopState, OdeProblem, Projection
from ._samples import SampleClock, with_start
from ._stages_of_equations import shared_diagonal

_STATUS_OF_RESULT = {
    "successful": Status.SUCCESS,
    "event_occurred": Status.EVENT,
    "max_steps_reached": Status.MAX_STEPS,
    "dt_min_reached": Status.STEP_SIZE,
    "nonfinite_input": Status.NOT_FINITE,
}
#: First adaptive step and least one, of the whole time.  The controller finds the right size within four steps of the
#: first, by its factor of at most ten each; below the least a time of its end cannot be told from its start.
_FIRST_STEP, _LEAST_STEP = 1e-3, 1e-13


class Equations(Protocol):
    """Equations of motion of the first order in y = (positions, second half, quadratures)."""

    def rate(self, t: Array, y: PyTree) -> PyTree:
        """The rate of y."""

    def project(self, t: Array, y: PyTree) -> Projection:
        """y on the constraints."""

    def state_at(self, t: Array, y: PyTree) -> Any:
        """The state that an event is a function of."""

    # def sample(self, t, y, due): y after the samples of the periods that are due (m,), where there are some


class Arguments(NamedTuple):
    """Arguments of the vector field: the equations, the events or None, the clock of the samples or None."""

    equations: Any
    events: Events | None = None
    clock: SampleClock | None = None


@jit
def _rate(t, y, args):
    return args.equations.rate(t, y)


def _stages(args, s, start):
    return args.equations.implicit_stages(s, start)


@jit
def _project(t, y, args):
    return args.equations.project(t, y)


def _sides(t, y, args):
    """Numbers (n,) that are constant beside the corners of the rate."""
    return args.equations.sides(t, y)


@jit
def _project_error(t, y, error, args):
    return args.equations.project_error(t, y, error)


def _values(t, y, args):
    """Values (n,) of the events."""
    return args.events.values(args.equations.state_at(t, y))


def _jump(t, y, args, number):
    """y after the action of an event beside the time t, as the motion from there has it at t.

    The motion is followed to the event, and after the action back to t, by one Newton step each: their values are
    rounding, their derivatives those of the event's time: the saltation matrix of hybrid systems (Leine and
    Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, 2004).
    """
    time, y = _on_the_event(t, y, args, number)
    acting = [k for k, acts in enumerate(args.events.acts) if acts]
    branch = jnp.searchsorted(jnp.asarray(acting, number.dtype), number)
    actions = [functools.partial(args.equations.after_action, number=k) for k in acting]
    y = lax.switch(branch, actions, time, y)
    return jax.tree.map(lambda y, r: y + (t - time) * r, y, args.equations.rate(time, y))


@jit
def _sample(t, y, args, due, numbers):
    """y after the samples of these numbers at the time t, as the motion from there has it at t: the samples move with
    the start and the periods, as the time of an event does in `_jump`."""
    time = args.clock.instants(numbers)[jnp.argmax(due)]
    return _sampled_at(t + (time - lax.stop_gradient(time)), lax.stop_gradient(t), y, args, due)


def _sampled_at(time, fixed, y, args, due):
    """y at a fixed time, from y there, with a sample at the time of the same value, which has derivatives."""
    y = attach_time_derivative(y, time, fixed, args.equations)
    y = args.equations.sample(time, y, due)
    return attach_time_derivative(y, 2.0 * fixed - time, fixed, args.equations)


def solves_stages(equations: Any, solver: diffrax.AbstractSolver) -> bool:
    """True if the equations solve the stages of an implicit method themselves, in place of its root finder."""
    return getattr(equations, "implicit_stages", None) is not None and shared_diagonal(solver) is not None


def integrate_equations(
    args: Arguments,
    y0: PyTree,
    times: tuple[Array, Array, Array],
    valid: Array,
    options: Options,
    *,
    has_projection: bool = False,
    saves_projection: bool = False,
    projection_is_error: bool = False,
    projects_error: bool = False,
    norm: Callable | None = None,
    has_corners: bool = False,
    periods: Array | None = None,
    samples_start: Array | None = None,
) -> tuple[OdeProblem, LoopState, PyTree]:
    """Integrate the equations from y0.

    Args:
        times: the start (), those to save (T,), the end (); y0 and the rows that are saved have derivatives by them.
        valid: () where it does not hold, no step is taken.
        norm: of the scaled error of a step, default the root mean square over positions and second half.
        has_corners: True for equations with `sides(t, y)` of the corners of their rate.
        periods: (m,) of samples, which `equations.sample(t, y, due)` takes; None for none.
        samples_start: time of their first, of a later part of a motion; default the start.

    Returns: the problem, the loop's final state, and y0 with its derivative by the start.
    """
    (t0, ts, t1), events = times, args.events
    span, start, save = stop_gradients((t1 - t0, t0, ts))
    if periods is not None:
        args = args._replace(clock=_clock(t0, periods, samples_start))
    clock = stop_gradients(args.clock)
    if clock is not None and not options.lands_on_times:
        save = clock.just_before(save)
    end, save = jnp.where(valid, start + span, start), jnp.where(valid, save, start)
    solver, controller = solver_or_default(options.solver), _controller(options, span, norm, has_corners)
    controller = stop_gradients(controller)
    first_step = stop_gradients(_FIRST_STEP * span if options.dt is None else options.dt)
    problem = OdeProblem(
        stop_gradients(with_tolerances(solver, controller)),
        controller,
        save,
        end,
        options.max_steps,
        _rate,
        stages=_stages if solves_stages(args.equations, solver) else None,
        project=_project if has_projection else None,
        saves_projection=saves_projection,
        projection_is_error=projection_is_error,
        project_error=_project_error if projects_error else None,
        event=None if events is None else _values,
        directions=(0,) if events is None else events.directions,
        jump=None if events is None or not any(events.acts) else _jump,
        acts=(False,) if events is None else events.acts,
        max_actions=0 if events is None else events.max_actions,
        restart=first_step,
        clock=clock,
        samples_end=None if clock is None else end,
        sample=None if clock is None else _sample,
        lands_on_times=options.lands_on_times,
        meter=diffrax.TqdmProgressMeter() if options.progress and not ON_TAPE.value else diffrax.NoProgressMeter(),
        checkpoints=options.checkpoints,
    )
    begin, y0 = _start(args, y0, t0, start, clock, samples_start is None)
    if options.loop == "diffeqsolve":
        state = integrate_by_diffeqsolve(problem, begin, start, first_step, args, options.gradient)
    elif options.gradient == "reverse":
        state = integrate_with_adjoint(reverse_only((begin, args), FORWARD_MODE), problem, start, first_step)
    else:
        state = integrate(problem, begin, start, first_step, args)
    return problem, with_start(state, y0, problem, start), y0


def _start(args, y0, t0, fixed, clock, is_first):
    """y0 at a fixed time of the same value as t0: after the samples that are due there, and before them."""
    late = 2.0 * fixed - t0  # a later start: what flows for less time
    then = attach_time_derivative(y0, late, fixed, args.equations)
    if clock is None:
        return then, then
    if is_first:
        return _first_sample(t0, y0, args, late, fixed), then
    due = clock.is_sample(fixed)
    sampled = _sample(fixed, then, args, due, clock.first - 1)
    return jax.tree.map(lambda new, old: jnp.where(jnp.any(due), new, old), sampled, then), then


def _clock(t0, periods, samples_start):
    """The clock of a motion that starts at t0, or of a later part of it."""
    if samples_start is None:
        return SampleClock(t0, periods)
    clock = SampleClock(samples_start, periods)
    return SampleClock(samples_start, periods, stop_gradients(clock).next_numbers(lax.stop_gradient(t0)))


def _first_sample(t0, y0, args, late, start):
    """y0 after the sample of the start, with its derivative by the start."""
    y = args.equations.sample(t0, y0, jnp.ones(args.clock.periods.shape, bool))
    return attach_time_derivative(y, late, start, args.equations)


def _controller(options, span, norm, has_corners):
    """The step-size controller: a given one, fixed steps, or a PID controller with the tolerances."""
    if options.controller is not None:
        return options.controller
    if options.dt is not None:
        return diffrax.ConstantStepSize()
    # quadratures such as work follow the motion and do not control its steps
    norm = norm or (lambda y: optimistix.rms_norm(y[:2]))
    rtol, atol, longest = stop_gradients((options.rtol, options.atol, options.longest_step))
    least = _LEAST_STEP * jnp.abs(span)
    controller = diffrax.PIDController(rtol=rtol, atol=atol, norm=norm, dtmin=least, dtmax=longest)
    return CornerController.around(controller, _sides) if has_corners else controller


@eqx.filter_custom_jvp
def attach_time_derivative(y: PyTree, t: Array, fixed_t: Array, equations: Any) -> PyTree:
    """y, or rows of it, computed at `fixed_t` without derivatives by it: its derivative by the time t is its rate."""
    return y


@attach_time_derivative.def_jvp
def _attach_time_derivative_jvp(primals, tangents):
    y, _, fixed_t, equations = primals
    y_dot, t_dot, _, _ = tangents
    if t_dot is None:
        return y, y_dot
    rate = jax.vmap(equations.rate)(fixed_t, y) if fixed_t.ndim else equations.rate(fixed_t, y)
    along = lambda r: r * t_dot.reshape(t_dot.shape + (1,) * (r.ndim - t_dot.ndim))
    return y, tuple(along(r) if d is None else d + along(r) for r, d in zip(rate, y_dot, strict=True))


def end_of_motion(state: LoopState, y0: PyTree, t1: Array, args: Arguments) -> tuple[Array, PyTree, Array]:
    """(time, y) at which the integration ended, the event's if that ended it; and True if all is finite.

    The derivative by the end that was asked for is the motion's rate.  What is not finite is the start instead, as
    its derivatives would make NaN of cotangents that are zero.
    """
    finite = jnp.all(jnp.stack([jnp.all(jnp.isfinite(x)) for x in state.y]))
    y = jax.tree.map(lambda x, x0: value_where(~finite, x, lax.stop_gradient(x0)), state.y, y0)
    happened = state.result == diffrax.RESULTS.event_occurred
    t = stop_gradients(state.t) + jnp.where(happened | ~jnp.isfinite(t1), 0.0, t1 - stop_gradients(t1))
    y = attach_time_derivative(y, t, stop_gradients(state.t), args.equations)
    if args.events is not None and state.bracket is not None:
        there = _on_the_event(t, y, args, jnp.maximum(state.bracket.fired, 0))
        t, y = jax.tree.map(lambda a, b: jnp.where(happened, a, b), there, (t, y))
    return t, y, finite


def _on_the_event(t, y, args, number):
    """(time, y) of an event from those beside it, with their derivatives: one Newton step along the motion."""
    rate = args.equations.rate(t, y)
    value, slope = jax.jvp(lambda t, y: _values(t, y, args)[number], (t, y), (jnp.ones_like(t), rate))
    late = value / jnp.where(slope == 0.0, 1.0, slope)
    return t - late, jax.tree.map(lambda y, r: y - late * r, y, rate)


def saved_rows(
    state: LoopState, ts: Array, end: tuple[Array, PyTree], args: Arguments
) -> tuple[Array, PyTree, Array]:
    """(times, rows of y, True for rows beyond the end); with an event one row more, the end's, in its place."""
    index = jnp.arange(len(ts), dtype=jnp.int32)
    beyond = (index >= state.saved) | ~jnp.isfinite(ts)  # after an end nothing is saved
    times = masked(beyond, ts, jnp.inf)
    ys = attach_time_derivative(state.ys, ts, stop_gradients(ts), args.equations)
    if args.events is None:
        return times, ys, beyond
    index = jnp.arange(len(ts) + 1, dtype=jnp.int32)
    times, ys = jax.tree.map(
        lambda x, x1: masked(index == state.saved, jnp.concatenate([x, x1[None]]), x1[None]), (times, ys), end
    )
    times = jnp.where(index <= state.saved, times, jnp.inf)
    return times, ys, ~jnp.isfinite(times)


def status_of(result: Any) -> Array:
    """The `Status` () of a result of diffrax."""
    code = jnp.asarray(Status.FAILED)
    for name, value in _STATUS_OF_RESULT.items():
        code = jnp.where(result == getattr(diffrax.RESULTS, name), value, code)
    return code
