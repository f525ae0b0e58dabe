"""The initial value problem that the loop integrates, and the state of the loop between two steps."""

from collections.abc import Callable
from typing import Any, NamedTuple

import diffrax
import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PyTree

from ._diffrax_internals import with_scan_kind
from ._event import EventBracket
from ._jumps import Jumps
from ._options import MIN_CHECKPOINTS
from ._samples import SampleClock


class Projection(NamedTuple):
    """A state projected onto its constraints at the end of a step.

    Attributes:
        y: the projected state.
        correction: how far each entry of its first part was moved (nq,); infinite where the projection failed.
        saved: what is saved in place of y, with the structure of y; None where y itself is saved.
    """

    y: PyTree
    correction: Array
    saved: PyTree = None


class OdeProblem(eqx.Module):
    """An initial value problem and how it is integrated.

    Its numbers carry no derivatives; `attach_time_derivative` adds those by times.

    Attributes:
        solver, controller: of diffrax.
        times: (T,) to save, sorted; those up to the start get the start.
        t1: the end; max_steps: bound on the attempted steps.
        rate: (t, y, args) -> rate of y.
        project: (t, y, args) -> Projection, applied at the end of every step.  The last stage of a
            first-same-as-last method is stale once y has moved, so the next step starts as after a jump.
        project_error: (t, y, error, args) -> the part of the error of a step to y, on the constraints, that moves y.
        stages: (args, s, start) -> stages of a step whose implicit method has s / h on its diagonal, from its
            `StageStart`: an object with `rate(t, y)`, the r with `r = f(t, y + s r)` and True if it was found.  None
            where the solver's own root finder solves them.
        saves_projection: save `Projection.saved` in place of y; not at the start.
        projection_is_error: count the correction as error of the step, so that a step that would end on another
            branch is retried, shorter; at fixed steps it ends the motion.
        event: (t, y, args) -> values (n,) whose changes of sign end the motion, as does one that is not a number.
        directions: of the events: +1 rising, -1 falling, 0 both.
        jump: (t, y, args, number) -> y after the action of an event; acts: True for the events that act and go on.
        max_actions: bound on their number; the one after it ends the motion.
        restart: least step after an action; fixed steps are as long.
        clock: of the samples; sample: (t, y, args, due (m,), numbers (m,)) -> y after the samples of the periods that
            are due, whose numbers they are; samples_end: the end of the motion, from which on none is taken.
        lands_on_times: end steps on `times`; otherwise states there are interpolated.
        checkpoints: steps that the adjoint stores; it serves motions of up to their square.
        meter: of progress.
        num_passed: (T,) number of times that are passed together with each, equal ones included; derived.
    """

    solver: diffrax.AbstractSolver
    controller: diffrax.AbstractStepSizeController
    times: Float[Array, " T"]
    t1: Array
    max_steps: Int[Array, ""]
    rate: Callable = eqx.field(static=True)
    project: Callable | None = eqx.field(static=True, default=None)
    project_error: Callable | None = eqx.field(static=True, default=None)
    stages: Callable | None = eqx.field(static=True, default=None)
    saves_projection: bool = eqx.field(static=True, default=False)
    projection_is_error: bool = eqx.field(static=True, default=False)
    event: Callable | None = eqx.field(static=True, default=None)
    directions: tuple[int, ...] = eqx.field(static=True, default=(0,))
    jump: Callable | None = eqx.field(static=True, default=None)
    acts: tuple[bool, ...] = eqx.field(static=True, default=(False,))
    max_actions: int = eqx.field(static=True, default=0)
    restart: Array | None = None
    clock: SampleClock | None = None
    samples_end: Array | None = None
    sample: Callable | None = eqx.field(static=True, default=None)
    lands_on_times: bool = eqx.field(static=True, default=True)
    meter: diffrax.AbstractProgressMeter = diffrax.NoProgressMeter()
    checkpoints: int = eqx.field(static=True, default=MIN_CHECKPOINTS)
    num_passed: Array | None = None

    def __post_init__(self) -> None:
        self.solver = with_scan_kind(self.solver, "lax")
        self.num_passed = jnp.searchsorted(self.times, self.times, side="right")

    @property
    def has_fixed_steps(self) -> bool:
        return isinstance(self.controller, diffrax.ConstantStepSize)

    @property
    def term(self) -> diffrax.ODETerm:
        return diffrax.ODETerm(self.rate)


class LoopState(eqx.Module):
    """The loop between two steps: y at t, the end of the step to attempt next, and what is saved so far.

    Attributes:
        memory: of the solver, of the controller, and True after a jump of y.
        tried, rejected: numbers of steps.
        saved: number of the times that are passed.
        ys: saved states (T, ...) or None; inside the loop (T + 1, ...): the extra last row is scratch space for
            discarded writes.
        projected: `Projection.saved` of y, None where y itself is saved.
        bracket: of the events; meter: state of the progress meter.
        sampled: numbers of the next samples, None without.
        jumps: both sides of the actions of events so far, None without such.
    """

    t: Array
    t_next: Array
    y: PyTree
    memory: Any
    result: Any
    tried: Int[Array, ""]
    rejected: Int[Array, ""]
    saved: Array
    ys: PyTree
    projected: PyTree
    bracket: EventBracket | None
    meter: PyTree
    sampled: Array | None = None
    jumps: Jumps | None = None

    def is_running(self, problem: OdeProblem) -> Bool[Array, ""]:
        """True while steps are left to take; false for NaN."""
        return (self.t < problem.t1) & diffrax.is_successful(self.result) & (self.tried < problem.max_steps)
