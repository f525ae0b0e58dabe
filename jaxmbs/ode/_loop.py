"""A motion step by step: diffrax's solvers and step sizes in a loop of the library.

`diffrax.diffeqsolve` accepts the same steps.  Its loop serves any term, save and adjoint, and compiles several times
as long; this one knows ordinary differential equations only.  Its adjoint is in `march_adjoint`.
"""

import functools
import math
from collections.abc import Callable

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from diffrax import RESULTS
from jax import lax
from jaxtyping import Array, PyTree

from ..runtime import any_lane, small_call
from . import _event as hunting
from ._implicit_step import is_diagonally_implicit
from ._implicit_step import step as implicit_step

#: A `close` that moves a coordinate further than this [rad or m] has left its branch.
_FAR = 0.3


class OdeProblem(eqx.Module):
    """What is integrated, and how.  Its numbers carry no derivatives: whoever asks for those by times adds them.

    Attributes:
        solver, controller: of diffrax.
        times: (T,) to save, sorted; those up to the start get the start.
        t1: the end; max_steps: bound on the steps tried.
        rate: (t, y, args) -> the rate of y.
        close: (t, y, args) -> (y, how far its first part moved, what is shown of it) at the end of every step.  A
            first-same-as-last stage is stale once y has moved, so the next step starts as after a jump.
        shows: whether what `close` shows is saved in place of y, whose structure it has; not of the start.
        watched: `moved` counts as error of the step: one that would end on another branch is made again, shorter;
            where steps are fixed it ends the motion.
        crossing: (t, y, args) -> value whose change of sign ends the motion; so does one that is not a number.
        lands: whether steps end on `times`; otherwise their states are interpolated.
        rows: steps that the adjoint logs; it serves motions of up to their square.
    """

    solver: diffrax.AbstractSolver
    controller: diffrax.AbstractStepSizeController
    times: Array
    t1: Array
    max_steps: Array
    rate: Callable = eqx.field(static=True)
    close: Callable | None = eqx.field(static=True, default=None)
    shows: bool = eqx.field(static=True, default=False)
    watched: bool = eqx.field(static=True, default=False)
    crossing: Callable | None = eqx.field(static=True, default=None)
    lands: bool = eqx.field(static=True, default=True)
    meter: diffrax.AbstractProgressMeter = diffrax.NoProgressMeter()
    rows: int = eqx.field(static=True, default=512)
    after: Array | None = None  # (T,) how many times are passed with each: found here

    def __post_init__(self):
        self.solver = with_scan(self.solver, "lax")
        self.after = jnp.searchsorted(self.times, self.times, side="right")

    @property
    def term(self):
        return diffrax.ODETerm(self.rate)


class LoopState(eqx.Module):
    """Where a march stands: y at t, the end of the step to try next, and what is saved so far.

    Attributes:
        memory: of the solver, of the controller, and whether y jumped.
        saved: how many of the times are passed; ys: (T, ...) or None, on the way (T + 1, ...): the last row takes
            what is not kept; shown: of y, None where y itself is saved; hunt: for the event; meter: of progress.
    """

    t: Array
    t_next: Array
    y: PyTree
    memory: PyTree
    result: PyTree
    tried: Array
    rejected: Array
    saved: Array
    ys: PyTree
    shown: PyTree
    hunt: hunting.EventBracket | None
    meter: PyTree

    def is_running(self, march: OdeProblem):
        """Whether steps are left to take: false for NaN."""
        return (self.t < march.t1) & diffrax.is_successful(self.result) & (self.tried < march.max_steps)


def rows_for(steps: int) -> int:
    """Rows that the log of a march of so many steps needs: a power of two, so that few programs differ by it."""
    return max(512, 1 << math.ceil(math.log2(max(steps, 1)) / 2))


def with_scan(solver, kind):
    """The solver with its loop over stages of a kind: "lax" has forward derivatives, "checkpointed" reverse."""
    if not hasattr(solver, "scan_kind"):
        return solver
    return eqx.tree_at(lambda s: s.scan_kind, solver, kind, is_leaf=lambda x: x is None)


def stop_gradients(tree):
    """The same numbers, without derivatives."""
    return jax.tree.map(lambda x: lax.stop_gradient(x) if eqx.is_inexact_array(x) else x, tree)


def integrate(march: OdeProblem, y0, t0, dt0, args) -> LoopState:
    """The end of the march from y0 at t0; dt0: the first step."""
    # lanes that are done wait: were this their own condition, every step would copy what all of them saved
    running = lambda walk: any_lane(walk.is_running(march))  # noqa: E731
    steps = functools.partial(lax.while_loop, running, lambda walk: attempt_step(march, walk, args)[0])
    return ended(march, small_call(steps)(begin(march, y0, t0, dt0, args)))


def begin(march: OdeProblem, y0, t0, dt0, args) -> LoopState:
    """Before the first step."""
    solver, term = march.solver, march.term
    order = solver.error_order(term)
    t_next, control = march.controller.init(term, t0, march.t1, stop_gradients(y0), dt0, args, solver.func, order)
    saved = jnp.searchsorted(march.times, t0, side="right")
    t_next = _clipped(march, t0, jnp.minimum(t_next, march.t1), jnp.asarray(True), saved)
    memory = solver.init(term, t0, t_next, y0, args), control, False
    ys = jax.tree.map(lambda y: jnp.broadcast_to(y[None], (march.times.size + 1, *y.shape)), y0)
    seen = None if march.crossing is None else hunting.begun(stop_gradients(march.crossing(t0, y0, args)))
    zero = jnp.zeros((), jnp.int32)
    shown = y0 if march.shows else None
    walk = LoopState(
        t0, t_next, y0, memory, RESULTS.successful, zero, zero, saved, ys, shown, seen, march.meter.init()
    )
    return jax.tree.map(lambda x: lax.convert_element_type(x, jnp.result_type(x)), walk)


def ended(march: OdeProblem, walk: LoopState) -> LoopState:
    """After the last step: the result code, and times saved twice."""
    march.meter.close(walk.meter)
    short = diffrax.is_successful(walk.result) & (walk.t < march.t1)
    result = RESULTS.where(short, RESULTS.max_steps_reached, walk.result)
    ys = jax.tree.map(lambda ys: ys[first_of_duplicates(march)], walk.ys)
    return eqx.tree_at(lambda w: (w.result, w.ys), walk, (result, ys))


def first_of_duplicates(march: OdeProblem):
    """(T,) the place of the first of equal times: only that one is filled."""
    return jnp.searchsorted(march.times, march.times, side="left")


def attempt_step(march: OdeProblem, walk: LoopState, args):
    """One step tried: (the walk after it, whether it was accepted, what the solver says of its inside)."""
    running, (state, control, jumped) = walk.is_running(march), walk.memory
    t, t1 = walk.t, walk.t_next
    y1, error, dense, new_state, failed = solver_step(march, t, t1, walk.y, args, state, jumped)
    y1, shown, error, failed = _apply_projection(march, t1, y1, error, args, failed)
    error = jax.tree.map(lambda e: jnp.where(jnp.isnan(e), jnp.inf, e), error)

    order = march.solver.error_order(march.term)
    keep, start, t_next, jump, new_control, refused = march.controller.adapt_step_size(
        t, t1, *stop_gradients((walk.y, y1)), args, stop_gradients(error), order, control
    )
    keep, found, lost, aim, seen = _hunted(march, walk, running & keep, y1, args)
    failed = RESULTS.where(keep, failed, RESULTS.successful)
    failed = RESULTS.where(diffrax.is_okay(failed), refused, failed)
    failed = RESULTS.where(lost & diffrax.is_okay(failed), RESULTS.nonfinite_input, failed)
    failed = RESULTS.where(found & diffrax.is_okay(failed), RESULTS.event_occurred, failed)

    saved, ys = _saved(march, walk, keep, shown if march.shows else y1, dense)
    start = jnp.where(keep, jnp.minimum(start, march.t1), t)
    t_next = _clipped(march, start, jnp.minimum(t_next, aim), keep, saved)
    after = LoopState(
        t=start,
        t_next=_chosen(running, t_next, t1),
        y=_chosen(keep, y1, walk.y),
        memory=(_chosen(keep, new_state, state), _chosen(running, new_control, control), _chosen(keep, jump, jumped)),
        result=RESULTS.where(running, failed, walk.result),
        tried=_counted(walk.tried, running),
        rejected=_counted(walk.rejected, running & ~keep),
        saved=saved,
        ys=ys,
        shown=None if walk.shown is None else _chosen(keep, shown, walk.shown),
        hunt=seen,
        meter=_progress(march, walk, start),
    )
    return after, keep, dense


def _progress(march, walk, t):
    """The meter at the time t."""
    if isinstance(march.meter, diffrax.NoProgressMeter):
        return walk.meter
    done, span = t - march.times[0], march.t1 - march.times[0]
    return march.meter.step(walk.meter, jnp.where(span > 0.0, done / jnp.where(span > 0.0, span, 1.0), 1.0))


def solver_step(march: OdeProblem, t, t1, y, args, state, jumped):
    """The solver's step: (y, error, inside, its memory, result)."""
    jumped = jumped if march.close is None else jumped | True
    if is_diagonally_implicit(march.solver):
        return implicit_step((y, args), (t, t1), march.solver, march.term, state, jumped)
    return march.solver.step(march.term, t, t1, y, args, state, jumped)


def _apply_projection(march, t1, y1, error, args, failed):
    """The end of a step after `close`, and what is shown of it."""
    if march.close is None:
        return y1, None, error, failed
    y1, moved, shown = march.close(t1, y1, args)
    if march.watched:
        if error is not None:
            error = (jnp.maximum(jnp.abs(error[0]), moved), *error[1:])
        near = jnp.max(moved, initial=0.0) < _FAR  # false for NaN
        lost = RESULTS.where(near, RESULTS.successful, RESULTS.nonlinear_divergence)
        failed = RESULTS.where(diffrax.is_okay(failed), lost, failed)
    return y1, shown, error, failed


def _hunted(march, walk, keep, y1, args):
    """As `hunt.hunted`, of the event."""
    if march.crossing is None:
        return keep, jnp.asarray(False), jnp.asarray(False), jnp.inf, None
    return hunting.locate_event(
        walk.hunt, walk.t, walk.t_next, stop_gradients(march.crossing(walk.t_next, y1, args)), keep
    )


def _clipped(march, t, t_next, keep, saved):
    """The end of the next step: not beyond the end of the march, nor the next time to save if it is to land there.

    The last hundred roundings before the end belong to the step; one made again takes half of what is left."""
    last = march.t1 - 100.0 * jnp.spacing(march.t1)
    end = jnp.where(keep, march.t1, t + 0.5 * (march.t1 - t))
    t_next = jnp.where(t_next > last, end, t_next)
    return jnp.minimum(t_next, next_save_time(march, saved)) if march.lands else t_next


def next_save_time(march: OdeProblem, saved):
    """The next time to save; infinite after the last."""
    return jnp.where(saved < march.times.size, march.times[saved], jnp.inf)


def _saved(march, walk, keep, y1, dense):
    """(times passed, ys) after a step that ends with y1."""
    if walk.ys is None:
        passed = jnp.searchsorted(march.times, walk.t_next, side="right")
        return jnp.where(keep, passed, walk.saved), None
    if march.lands:
        hit = keep & (next_save_time(march, walk.saved) <= walk.t_next)
        ys = set_row(walk.ys, jnp.where(hit, walk.saved, march.times.size), y1)
        return jnp.where(hit, march.after[walk.saved], walk.saved), ys

    def left(carry):
        return keep & (next_save_time(march, carry[0]) <= walk.t_next)

    def save(carry):
        saved, ys = carry
        y = interpolated(march, walk.t, walk.t_next, y1, dense, march.times[saved])
        return _counted(saved, left(carry)), set_row(ys, jnp.where(left(carry), saved, march.times.size), y)

    return lax.while_loop(lambda carry: any_lane(left(carry)), save, (walk.saved, walk.ys))


def interpolated(march: OdeProblem, t0, t1, y1, dense, t):
    """The state at a time t of a step, that of its end after `close`."""
    inside = march.solver.interpolation_cls(t0=t0, t1=t1, **dense).evaluate(t)
    return jax.tree.map(lambda end, y: jnp.where(t == t1, end, y), y1, inside)


def set_row(ys, index, y):
    """y in its place among the rows ys."""
    update = functools.partial(lax.dynamic_update_index_in_dim, axis=0, allow_negative_indices=False)
    return jax.tree.map(lambda ys, y: update(ys, y, index), ys, y)


def _counted(number, more):
    return jnp.where(more, number + 1, number)


def _chosen(condition, new, old):
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), new, old)
