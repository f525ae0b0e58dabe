"""The same integration by `diffrax.diffeqsolve`: projection in its solver; saved times, events and the bound on steps
in its step-size controller."""

from typing import Any, NamedTuple

import diffrax
import jax
import jax.numpy as jnp
from diffrax import RESULTS
from jax import Array, lax
from jaxtyping import PyTree

from ..runtime import FORWARD_MODE, reverse_only
from ._diffrax_internals import with_scan_kind
from ._event import EventBracket, locate_event, start_bracket
from ._loop import next_save_time, project_step, solver_step, stop_gradients
from ._problem import LoopState, OdeProblem
from ._projected_solver import ProjectedSolver


def integrate_by_diffeqsolve(
    problem: OdeProblem, y0: PyTree, t0: Array, dt0: Array, args: PyTree, gradient: str
) -> LoopState:
    """The state that `integrate` ends with, by diffrax's own loop and its adjoints.

    It accepts the same steps.  Events that act are not served (`options` refuses them).
    """
    if gradient == "reverse":
        adjoint: Any = diffrax.RecursiveCheckpointAdjoint(checkpoints=problem.checkpoints)
        y0, args = reverse_only((y0, args), FORWARD_MODE)
    else:
        adjoint = diffrax.ForwardMode()
    kind = "checkpointed" if gradient == "reverse" else "lax"
    saved_at = diffrax.SubSaveAt(ts=jnp.clip(problem.times, t0, problem.t1)), diffrax.SubSaveAt(t1=True)
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(problem.rate),
        _LoopSolver(with_scan_kind(problem.solver, kind), problem.project, problem),
        t0,
        problem.t1,
        dt0,
        y0,
        args,
        saveat=diffrax.SaveAt(subs=list(saved_at), controller_state=True),
        stepsize_controller=_LoopController(problem),
        adjoint=adjoint,
        max_steps=None,
        throw=False,
        progress_meter=problem.meter,
    )
    return _loop_state(problem, solution, y0, t0)


def _loop_state(problem, solution, y0, t0):
    """The loop's final state from a solution of diffrax."""
    (_, (end,)), (ys, y) = solution.ts, solution.ys
    y, end = jax.tree.map(lambda x: x[0], y), stop_gradients(end)
    saved = jnp.searchsorted(problem.times, end, side="right")
    is_start = problem.times <= t0
    with_start = lambda x, x0: jnp.where(is_start.reshape(-1, *[1] * x0.ndim), x0[None], x)
    stats = solution.stats
    return LoopState(
        t=end,
        t_next=end,
        y=y,
        memory=None,
        result=solution.result,
        tried=jnp.asarray(stats["num_steps"], jnp.int32),
        rejected=jnp.asarray(stats["num_rejected_steps"], jnp.int32),
        saved=saved,
        ys=jax.tree.map(with_start, ys, y0),
        projected=None,
        bracket=solution.controller_state.bracket,
        meter=None,
    )


class _LoopSolver(ProjectedSolver):
    """The loop's step of a solver: with the derivative of implicit stages by the implicit function theorem, and the
    correction by the projection as part of the error."""

    problem: OdeProblem

    @property
    def interpolation_cls(self):
        return super().interpolation_cls if self.problem.project else self.solver.interpolation_cls

    def step(self, terms, t0, t1, y0, args, solver_state, made_jump):
        problem, solver = self.problem, self.solver
        y1, error, dense, memory, failed = solver_step(problem, t0, t1, y0, args, solver_state, made_jump, solver)
        if problem.project is None:
            return y1, error, dense, memory, failed
        y1, _, error, failed = project_step(problem, t1, y1, error, args, failed)
        return y1, error, {"dense": dense, "end": y1}, memory, failed


class _ControllerState(NamedTuple):
    """Of the inner controller; the number of times passed, the events' brackets, the number of steps tried."""

    inner: Any
    saved: Array
    bracket: EventBracket | None
    tried: Array


class _LoopController(diffrax.AbstractStepSizeController):
    """A step-size controller that lands on the saved times, locates events and bounds the number of steps."""

    problem: OdeProblem

    def wrap(self, direction: Any) -> "_LoopController":
        return self  # motions go forward in time

    def init(self, terms, t0, t1, y0, dt0, args, func, error_order) -> tuple:
        problem = self.problem
        t_next, inner = problem.controller.init(
            problem.term, t0, t1, stop_gradients(y0), dt0, args, func, error_order
        )
        saved = jnp.searchsorted(problem.times, t0, side="right")
        bracket = None if problem.event is None else start_bracket(stop_gradients(problem.event(t0, y0, args)))
        zero = jnp.zeros((), jnp.int32)
        return self._landing(t_next, saved), _ControllerState(inner, saved, bracket, zero)

    def adapt_step_size(
        self,
        t0: Any,
        t1: Any,
        y0: PyTree,
        y1_candidate: PyTree,
        args: PyTree,
        y_error: PyTree | None,
        error_order: Any,
        controller_state: Any,
    ) -> tuple:
        problem, state = self.problem, controller_state
        y0, y1, y_error = stop_gradients((y0, y1_candidate, y_error))
        found: Any = problem.controller.adapt_step_size(t0, t1, y0, y1, args, y_error, error_order, state.inner)
        keep, start, t_next, jumped, inner, result = found
        bracket, fired = None, jnp.asarray(False)
        if state.bracket is not None and problem.event is not None:
            values = stop_gradients(problem.event(t1, y1, args))
            keep, lost, aim, bracket = locate_event(state.bracket, t0, t1, values, keep, problem.directions)
            fired, start, t_next = keep & (bracket.fired >= 0), jnp.where(keep, t1, t0), jnp.minimum(t_next, aim)
            result = RESULTS.where(lost & diffrax.is_okay(result), RESULTS.nonfinite_input, result)
            result = RESULTS.where(fired & diffrax.is_okay(result), RESULTS.event_occurred, result)
        saved = jnp.where(keep, jnp.searchsorted(problem.times, t1, side="right"), state.saved)
        tried = state.tried + 1
        spent = (tried >= problem.max_steps) & (start < problem.t1)
        result = RESULTS.where(spent & diffrax.is_successful(result), RESULTS.max_steps_reached, result)
        state = lax.stop_gradient(_ControllerState(inner, saved, bracket, tried))
        return keep, start, self._landing(t_next, saved), jumped, state, result

    def _landing(self, t_next, saved):
        return jnp.minimum(t_next, next_save_time(self.problem, saved)) if self.problem.lands_on_times else t_next
