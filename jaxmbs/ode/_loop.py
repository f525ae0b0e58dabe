"""ODE integration loop: diffrax's solvers and step-size controllers without `diffeqsolve`.

`diffrax.diffeqsolve` accepts the same steps.  Its loop serves any term, save and adjoint, and compiles several times
as long; this one integrates ordinary differential equations only, and projects, brackets events and logs steps for an
exact adjoint (`_adjoint`) on the way.
"""

import dataclasses
import functools
from typing import Any, TypeVar

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from diffrax import RESULTS
from jax import lax
from jaxtyping import Array, PyTree

from ..runtime import any_in_batch, expose, jit, small_call
from ._diffrax_internals import is_diagonally_implicit
from ._event import EventBracket, bracket_after_action, locate_event, start_bracket
from ._implicit_step import step as implicit_step
from ._jumps import Jumps
from ._problem import LoopState, OdeProblem, Projection
from ._samples import after_samples, due_samples, first_numbers, land_on_sample, limit_length
from ._stages_of_equations import step as step_by_stages

#: Largest correction of a coordinate by the projection [rad or m].  A larger one means another assembly branch: two
#: branches of a loop are a radian or a link length apart, and steps of small error are corrected by far less.
_BRANCH_DISTANCE = 0.3
#: A step that ends so many roundings before the end of the motion is stretched to it, as in diffrax's `_clip_to_end`:
#: the step that would be left is too short for its rate to be told from rounding.
_END_ROUNDINGS = 100.0

Tree = TypeVar("Tree")


def stop_gradients(tree: Tree) -> Tree:
    """The same numbers without derivatives."""
    return jax.tree.map(lambda x: lax.stop_gradient(x) if eqx.is_inexact_array(x) else x, tree)


def integrate(problem: OdeProblem, y0: PyTree, t0: Array, dt0: Array, args: PyTree) -> LoopState:
    """Integrate from y0 at t0 to the end; dt0 is the first step."""
    # under vmap, iterate until every batch element is done: a batched condition would copy all saved rows each step
    running = lambda state: any_in_batch(state.is_running(problem))
    steps = functools.partial(lax.while_loop, running, lambda state: attempt_step(problem, state, args)[0])
    return finish(problem, small_call(steps)(begin(problem, y0, t0, dt0, args)))


def begin(problem: OdeProblem, y0: PyTree, t0: Array, dt0: Array, args: PyTree) -> LoopState:
    """The loop's state before the first step."""
    solver, term = problem.solver, problem.term
    t0 = lax.convert_element_type(t0, jnp.result_type(t0))  # as in later steps, so that the rate is traced once
    order = solver.error_order(term)
    t_next, control = problem.controller.init(term, t0, problem.t1, stop_gradients(y0), dt0, args, solver.func, order)
    saved = jnp.searchsorted(problem.times, t0, side="right")
    first, sampled = jnp.minimum(t_next, problem.t1), first_numbers(problem)
    t_next = _clip_step(problem, t0, first, jnp.asarray(True), saved, sampled)
    memory = solver.init(term, t0, t_next, y0, args), control, False
    ys = jax.tree.map(lambda y: jnp.broadcast_to(y[None], (problem.times.size + 1, *y.shape)), y0)
    bracket = None if problem.event is None else start_bracket(stop_gradients(problem.event(t0, y0, args)))
    zero = jnp.zeros((), jnp.int32)
    projected, meter = y0 if problem.saves_projection else None, problem.meter.init()
    counts = zero, zero, saved
    jumps = None if problem.jump is None else Jumps.empty(y0, t0, problem.max_actions)
    state = LoopState(
        t0, t_next, y0, memory, RESULTS.successful, *counts, ys, projected, bracket, meter, sampled, jumps
    )
    return jax.tree.map(lambda x: lax.convert_element_type(x, jnp.result_type(x)), state)


def finish(problem: OdeProblem, state: LoopState) -> LoopState:
    """The loop's state after the last step, with its result code and the rows of times that occur twice."""
    problem.meter.close(state.meter)
    short = diffrax.is_successful(state.result) & (state.t < problem.t1)
    result = RESULTS.where(short, RESULTS.max_steps_reached, state.result)
    first = first_of_duplicates(problem)
    ys = jax.tree.map(lambda ys: ys[first], state.ys)
    jumps = None if state.jumps is None else state.jumps.finished()
    return dataclasses.replace(state, result=result, ys=ys, jumps=jumps)


def first_of_duplicates(problem: OdeProblem) -> Array:
    """Index (T,) of the first of equal times; only that row is filled."""
    return jnp.searchsorted(problem.times, problem.times, side="left")


@jit  # traced once for the loop, its derivative's and the shape of its log
def attempt_step(problem: OdeProblem, state: LoopState, args: PyTree) -> tuple[LoopState, Array, PyTree]:
    """One attempted step: (the loop's state after it, True if it was accepted, the solver's dense output)."""
    running, (solver_state, control, jumped) = state.is_running(problem), state.memory
    t, t1 = state.t, state.t_next
    y1, error, dense, new_state, failed = solver_step(problem, t, t1, state.y, args, solver_state, jumped)
    y1, saved_y, error, failed = project_step(problem, t1, y1, error, args, failed)
    error = jax.tree.map(lambda e: jnp.where(jnp.isnan(e), jnp.inf, e), error)

    order: Any = problem.solver.error_order(problem.term)
    keep, start, t_next, jump, new_control, refused = problem.controller.adapt_step_size(
        t, t1, *stop_gradients((state.y, y1)), args, stop_gradients(error), order, control
    )
    keep, lost, aim, bracket = _locate_event(problem, state, running & keep, y1, args)
    acting, ends = _is_acting(problem, bracket, keep)
    failed = RESULTS.where(keep, failed, RESULTS.successful)
    failed = RESULTS.where(diffrax.is_okay(failed), refused, failed)
    failed = RESULTS.where(lost & diffrax.is_okay(failed), RESULTS.nonfinite_input, failed)
    failed = RESULTS.where(ends & diffrax.is_okay(failed), RESULTS.event_occurred, failed)

    saved, ys = _save(problem, state, keep, saved_y if problem.saves_projection else y1, dense)
    before = y1
    y1, bracket = _perform_action(problem, state, acting, y1, args, bracket)
    jumps = state.jumps
    if jumps is not None:
        jumps = jumps.with_jump(state.bracket.actions, acting, state.t_next, before, y1)  # type: ignore[union-attr]
    due = due_samples(problem, state, keep, ends)
    y1, bracket = _take_samples(problem, state, acting, due, y1, args, bracket)
    sampled = None if due is None else state.sampled + due.astype(jnp.int32)  # type: ignore[operator]
    start = expose(jnp.where(keep, jnp.minimum(start, problem.t1), t))
    t_next = _limit_by_events(problem, acting, start, t_next, aim)
    t_next = _clip_step(problem, start, t_next, keep, saved, sampled)
    if problem.jump is not None:
        jump = jump | acting
    if due is not None:
        jump = jump | jnp.any(due)
    after = LoopState(
        t=start,
        t_next=_select(running, t_next, t1),
        y=_select(keep, y1, state.y),
        memory=(
            _select(keep, new_state, solver_state),
            _select(running, new_control, control),
            _select(keep, jump, jumped),
        ),
        result=RESULTS.where(running, failed, state.result),
        tried=_increment_if(state.tried, running),
        rejected=_increment_if(state.rejected, running & ~keep),
        saved=saved,
        ys=ys,
        projected=None if state.projected is None else _select(keep, saved_y, state.projected),
        bracket=_select(running, bracket, state.bracket),
        meter=_update_meter(problem, state, start),
        sampled=sampled,
        jumps=jumps,
    )
    return after, keep, dense


def _update_meter(problem, state, t):
    """State of the progress meter at the time t."""
    if isinstance(problem.meter, diffrax.NoProgressMeter):
        return state.meter
    done, span = t - problem.times[0], problem.t1 - problem.times[0]
    return problem.meter.step(state.meter, jnp.where(span > 0.0, done / jnp.where(span > 0.0, span, 1.0), 1.0))


def solver_step(
    problem: OdeProblem,
    t: Array,
    t1: Array,
    y: PyTree,
    args: PyTree,
    solver_state: Any,
    jumped: Any,
    solver: Any = None,
) -> Any:
    """The step of the problem's solver, or of another: (y, error, dense output, its memory, result)."""
    solver = problem.solver if solver is None else solver
    jumped = jumped if problem.project is None else True
    if problem.stages is not None and solver is problem.solver:
        return step_by_stages(problem, t, t1, y, args, solver_state)
    if is_diagonally_implicit(solver):
        return implicit_step((y, args), (t, t1), solver, problem.term, solver_state, jumped)
    return solver.step(problem.term, t, t1, y, args, solver_state, jumped)


def project_step(problem: OdeProblem, t1: Array, y1: PyTree, error: Any, args: PyTree, failed: Any) -> tuple:
    """The end of a step after the projection, what is saved of it, its error and result."""
    if problem.project is None:
        return y1, None, error, failed
    projection: Projection = problem.project(t1, y1, args)
    correction = projection.correction
    if problem.projection_is_error:
        if error is not None:
            error = (jnp.maximum(jnp.abs(error[0]), correction), *error[1:])
        near = jnp.max(correction, initial=0.0) < _BRANCH_DISTANCE  # false for NaN
        lost = RESULTS.where(near, RESULTS.successful, RESULTS.nonlinear_divergence)
        failed = RESULTS.where(diffrax.is_okay(failed), lost, failed)
    if problem.project_error is not None and error is not None:
        error = problem.project_error(t1, *stop_gradients((projection.y, error, args)))
    return projection.y, projection.saved, error, failed


def _locate_event(problem, state, keep, y1, args):
    """`locate_event` of the problem's events, where it has some."""
    if problem.event is None:
        return keep, jnp.asarray(False), jnp.inf, None
    value = stop_gradients(problem.event(state.t_next, y1, args))
    return locate_event(state.bracket, state.t, state.t_next, value, keep, problem.directions)


def _is_acting(problem, bracket: EventBracket | None, keep):
    """True if the event at the end of a step acts, and if it ends the motion."""
    if bracket is None:
        return jnp.asarray(False), jnp.asarray(False)
    fired = keep & (bracket.fired >= 0)
    if problem.jump is None:
        return jnp.asarray(False), fired
    acts = jnp.asarray(problem.acts)[jnp.maximum(bracket.fired, 0)] & (bracket.actions < problem.max_actions)
    return fired & acts, fired & ~acts


def _limit_by_events(problem, acting, start, t_next, aim):
    """The end of the next step, not beyond what event location aims at.

    The step that ended on an event may be tiny: after an action the next one is as the first of a motion.
    """
    if problem.jump is None or problem.restart is None:
        return jnp.minimum(t_next, aim)
    return jnp.where(acting, jnp.maximum(t_next, start + problem.restart), jnp.minimum(t_next, aim))


def _perform_action(problem, state, acting, y1, args, bracket):
    """The end of a step after the action of its event, and the brackets from there."""
    if problem.jump is None:
        return y1, bracket
    y = after_action(problem, state.t_next, y1, args, acting, bracket.fired)

    def values_and_rates():
        values, t = lambda t, y: problem.event(t, y, args), state.t_next  # type: ignore[misc]
        along = lambda y: jax.jvp(values, (t, y), (jnp.ones_like(t), problem.rate(t, y, args)))
        return stop_gradients((along(y1)[1], *along(y)))

    found = lax.cond(any_in_batch(acting), values_and_rates, lambda: (bracket.value,) * 3)
    return y, _select(acting, bracket_after_action(bracket, state.bracket, *found, problem.directions), bracket)


def after_action(problem: OdeProblem, t: Array, y: PyTree, args: PyTree, acting: Array, fired: Array) -> PyTree:
    """y at the time t after the action of the event `fired` where it is `acting`."""
    jump = lambda: problem.jump(t, y, args, jnp.maximum(fired, 0))  # type: ignore[misc]
    return _select(acting, lax.cond(any_in_batch(acting), jump, lambda: y), y)


def _take_samples(problem, state, acting, due, y1, args, bracket):
    """The end of a step after its samples, and the brackets from there: what crosses with a sample does not count."""
    if due is None:
        return y1, bracket
    y, happens = after_samples(problem, state.t_next, y1, args, due, state.sampled), jnp.any(due)
    if bracket is None:
        return y, None
    values = lambda: stop_gradients(problem.event(state.t_next, y, args))
    values = lax.cond(any_in_batch(happens), values, lambda: bracket.value)
    return y, _select(happens & ~acting, start_bracket(values, bracket.actions, bracket.fired), bracket)


def _clip_step(problem, t, t_next, keep, saved, sampled):
    """The end of the next step: not beyond the end of the motion or the next sample, nor beyond the next time to save
    if it lands there.

    A step that comes within rounding of the end is stretched to it; one that is retried takes half of what is left.
    """
    t_next = limit_length(problem, t, t_next)
    last = problem.t1 - _END_ROUNDINGS * jnp.spacing(problem.t1)
    end = jnp.where(keep, problem.t1, t + 0.5 * (problem.t1 - t))
    t_next = jnp.where(t_next > last, end, t_next)
    save_time = next_save_time(problem, saved) if problem.lands_on_times else jnp.inf
    t_next = land_on_sample(problem, t_next, keep, sampled, save_time)
    return jnp.minimum(t_next, save_time) if problem.lands_on_times else t_next


def next_save_time(problem: OdeProblem, saved: Array) -> Array:
    """The next time to save; infinite after the last."""
    return jnp.where(saved < problem.times.size, problem.times[saved], jnp.inf)


def _save(problem, state, keep, y1, dense):
    """(number of times passed, ys) after a step that ends with y1."""
    if state.ys is None:
        passed = jnp.searchsorted(problem.times, state.t_next, side="right")
        return jnp.where(keep, passed, state.saved), None
    if problem.lands_on_times:
        hit = keep & (next_save_time(problem, state.saved) <= state.t_next)
        ys = set_row(state.ys, jnp.where(hit, state.saved, problem.times.size), y1)
        return jnp.where(hit, problem.num_passed[state.saved], state.saved), ys

    def left(carry):
        return keep & (next_save_time(problem, carry[0]) <= state.t_next)

    def save(carry):
        saved, ys = carry
        y = interpolate(problem, state.t, state.t_next, y1, dense, problem.times[saved])
        return _increment_if(saved, left(carry)), set_row(ys, jnp.where(left(carry), saved, problem.times.size), y)

    return lax.while_loop(lambda carry: any_in_batch(left(carry)), save, (state.saved, state.ys))


def interpolate(problem: OdeProblem, t0: Array, t1: Array, y1: PyTree, dense: Any, t: Array) -> PyTree:
    """The state at a time t of a step; at its end the projected one."""
    inside = problem.solver.interpolation_cls(t0=t0, t1=t1, **dense).evaluate(t)
    return jax.tree.map(lambda end, y: jnp.where(t == t1, end, y), y1, inside)


def set_row(ys: PyTree, index: Array, y: PyTree) -> PyTree:
    """The rows ys with y as row `index`."""
    update = functools.partial(lax.dynamic_update_index_in_dim, axis=0, allow_negative_indices=False)
    return jax.tree.map(lambda ys, y: update(ys, y, index), ys, y)


def _increment_if(number, condition):
    return jnp.where(condition, number + 1, number)


def _select(condition, new, old):
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), new, old)
