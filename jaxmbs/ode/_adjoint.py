"""Discrete adjoint of the integration loop: exact for the steps that were taken, their times without derivatives.

The start of every accepted step is logged, with the stages of explicit Runge-Kutta methods.  When the log is full it
keeps every second one, then every fourth; from each of those the steps up to the next are taken once more before they
are differentiated.  So memory is bounded by two logs of `problem.checkpoints` steps, whatever the length of the
motion (checkpointing on two levels; Griewank and Walther, Evaluating Derivatives, 2008, chapter 12, has the theory).
"""

import functools

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array

from ..runtime import Packing, any_in_batch, small_call, tuning
from ._diffrax_internals import has_explicit_stages
from ._jumps import Jumps
from ._loop import attempt_step, begin, finish, first_of_duplicates, integrate, set_row
from ._problem import LoopState, OdeProblem
from ._step_vjp import first_memory, memory_of, step_vjp


class CheckpointBuffer(eqx.Module):
    """The log: rows (size + 1, ...) of the accepted steps whose number is a multiple of `stride`.

    Rows are packed into vectors; the extra last row is scratch space for discarded writes.

    Attributes:
        numbers: of the steps, -1 for a free row.
        count: of the accepted steps so far.
    """

    rows: Array
    numbers: Array
    stride: Array
    count: Array
    packing: Packing = eqx.field(static=True)

    @classmethod
    def empty(cls, packing, size):
        rows, numbers = jnp.zeros((size + 1, packing.size), packing.dtype), jnp.full(size + 1, -1, jnp.int32)
        return cls(rows, numbers, jnp.ones((), jnp.int32), jnp.zeros((), jnp.int32), packing)

    def with_step(self, row, keep):
        """The log after an attempted step, which is logged if it was accepted (`keep`)."""
        size = self.numbers.size - 1
        stride = jnp.where(keep & (self.count == size * self.stride), 2 * self.stride, self.stride)
        free = jnp.where(self.count < size, self.count, _first(self.numbers[:-1] % stride != 0))
        slot = jnp.where(keep & (self.count % stride == 0), free, size)
        count = jnp.where(keep, self.count + 1, self.count)
        return CheckpointBuffer(
            set_row(self.rows, slot, row), set_row(self.numbers, slot, self.count), stride, count, self.packing
        )

    def at(self, number):
        """The row of a logged step."""
        slot = jnp.where(self.stride == 1, jnp.maximum(number, 0), _first(self.numbers[:-1] == number))
        return _row(self.rows, slot)


def _first(found):
    return jnp.argmax(found).astype(jnp.int32)


def _row(rows, index):
    return lax.dynamic_index_in_dim(rows, index, keepdims=False, allow_negative_indices=False)


def _log_entry(problem: OdeProblem, state: LoopState, after: LoopState, dense):
    """The log's row of a step: the loop's state before it, the dense output of a method with explicit stages, the
    event that acted at its end, -1 for none, and the periods that were sampled there."""
    before = state.t, state.t_next, state.y, state.memory, state.saved, state.bracket, state.sampled
    acted = None
    if state.bracket is not None and after.bracket is not None and problem.jump is not None:
        acted = jnp.where(after.bracket.actions > state.bracket.actions, after.bracket.fired, -1)
    due = None if state.sampled is None else after.sampled > state.sampled  # type: ignore[operator]
    return before, dense if has_explicit_stages(problem.solver) else None, acted, due


def _packing(problem, y0, t0, dt0, args):
    """The packing of the log's rows."""

    def row():
        state = begin(problem, y0, t0, dt0, args)
        after, _, dense = attempt_step(problem, state, args)
        return _log_entry(problem, state, after, dense)

    return Packing(jax.eval_shape(row), t0.dtype)


def _resume(before) -> LoopState:
    """The loop's state that was logged, to continue from; it saves nothing."""
    t, t_next, y, memory, saved, bracket, sampled = before
    zero = jnp.zeros_like(saved)
    result = jax.tree.map(jnp.asarray, diffrax.RESULTS.successful)
    return LoopState(t, t_next, y, memory, result, zero, zero, saved, None, None, bracket, None, sampled)


@eqx.filter_custom_vjp
def integrate_with_adjoint(start, problem: OdeProblem, t0, dt0) -> LoopState:
    """`integrate` from start = (y0, args), with reverse derivatives by them."""
    y0, args = start
    return integrate(problem, y0, t0, dt0, args)


@integrate_with_adjoint.def_fwd
def _forward(perturbed, start, problem, t0, dt0):
    del perturbed
    y0, args = start
    first = begin(problem, y0, t0, dt0, args)
    packing = _packing(problem, y0, t0, dt0, args)

    def body(carry):
        state, log = carry
        after, keep, dense = attempt_step(problem, state, args)
        return after, log.with_step(packing.pack(_log_entry(problem, state, after, dense)), keep)

    running = lambda carry: any_in_batch(carry[0].is_running(problem))
    steps = functools.partial(lax.while_loop, running, body)
    state, log = small_call(steps)((first, CheckpointBuffer.empty(packing, problem.checkpoints)))
    state = finish(problem, state)
    return state, (log, state.t, first.saved, state.saved)


@integrate_with_adjoint.def_bwd
def _backward(kept, bars, perturbed, start, problem, t0, dt0):
    (log, t_end, skipped, saved), (y0, args) = kept, start
    moving = jax.tree.map(lambda x, p: p and eqx.is_inexact_array(x), args, perturbed[1])
    moving, fixed = eqx.partition(args, moving)
    small, large = eqx.partition(moving, lambda x: x.size <= tuning.PACKED_COTANGENT)
    packing, numbers = log.packing, Packing(small, t0.dtype)

    def args_of(moving):
        return eqx.combine(numbers.unpack(moving[0]), moving[1], fixed)

    moving = numbers.pack(small), large
    y_bar, projected_bar = (
        _with_zeros(bars.y, y0),
        _with_zeros(bars.projected, y0) if problem.saves_projection else None,
    )
    ys_bar = _with_zeros(
        bars.ys, jax.tree.map(lambda y: jnp.broadcast_to(y[None], (problem.times.size, *y.shape)), y0)
    )
    first_row = first_of_duplicates(problem)
    ys_bar = jax.tree.map(lambda ys: jnp.zeros_like(ys).at[first_row].add(ys), ys_bar)
    jumps_bar = None
    if problem.jump is not None:
        none = Jumps.empty(y0, t0, problem.max_actions).finished()
        jumps_bar = _with_zeros(bars.jumps, none)
    last = jnp.where(log.count > 0, (log.count - 1) // log.stride, -1)

    def segment(carry):
        number, end, pieces, bars = carry
        row = log.at(number * log.stride)
        start = packing.unpack(row)[0]
        pieces, count = _repeat_steps(
            problem, args, packing, row, jnp.where(number >= 0, end, start[0]), pieces, log.stride
        )
        count = jnp.where(number >= 0, count, 0)

        def one(carry):
            k, bars = carry
            row = packing.unpack(_row(pieces, jnp.maximum(k, 0)))
            found = step_vjp(problem, args_of, moving, row, bars, ys_bar, jumps_bar)
            counts = is_used | (row[0][4] <= last_used) | _leads_to_jump(row, last_jump)
            # in a batch others may have more steps: this one has none before its first
            keep = lambda new, old: jnp.where((k >= 0) & (counts | jnp.isfinite(new)), new, old)
            return k - 1, jax.tree.map(keep, found, bars)

        bars = lax.while_loop(lambda carry: any_in_batch(carry[0] >= 0), one, (count - 1, bars))[1]
        return number - 1, start[0], pieces, bars

    memory = jax.tree.map(jnp.zeros_like, memory_of(problem, packing.unpack(log.rows[0])[0][3]))
    # steps after the last state that is used are left out where they are not finite, which would make NaN of zeros;
    # others stay, as a cotangent that is zero may have a derivative
    index = jnp.arange(problem.times.size, dtype=jnp.int32)
    is_used, last_used = _any_nonzero((y_bar, projected_bar)), _last_in_use(ys_bar)
    last_jump = None if jumps_bar is None else _last_in_use((jumps_bar.before, jumps_bar.after))
    first = (
        last,
        t_end,
        jnp.zeros_like(log.rows),
        (jax.tree.map(jnp.zeros_like, moving), y_bar, memory, projected_bar),
    )
    bars = lax.while_loop(lambda carry: any_in_batch(carry[0] >= 0), segment, first)[3]
    moving_bar, y_bar = first_memory(problem, y0, t0, dt0, args_of, moving, bars[:3])
    is_start = (index < skipped) | (index >= saved)  # rows of the start: saved before the first step, or never

    def with_start_rows(y_bar, ys_bar):
        return y_bar + jnp.sum(jnp.where(is_start.reshape(-1, *[1] * (ys_bar.ndim - 1)), ys_bar, 0.0), axis=0)

    return jax.tree.map(with_start_rows, y_bar, ys_bar), eqx.combine(numbers.unpack(moving_bar[0]), moving_bar[1])


def _repeat_steps(problem, args, packing, row, end, pieces, stride):
    """Rows of the steps from a logged one to the time `end`, and their number; the logged step itself is copied."""
    start, pieces = packing.unpack(row)[0], set_row(pieces, jnp.zeros((), jnp.int32), row)
    to = lax.stop_gradient(jnp.where(stride > 1, end, start[0]))  # rows have derivatives, times have none
    shorter = eqx.tree_at(
        lambda m: (m.t1, m.max_steps, m.meter),
        problem,
        (to, jnp.asarray(jnp.iinfo(problem.max_steps.dtype).max, problem.max_steps.dtype), diffrax.NoProgressMeter()),
    )

    def body(carry):
        state, pieces, count = carry
        after, keep, dense = attempt_step(shorter, state, args)
        pieces = set_row(
            pieces,
            jnp.where(keep, count, problem.checkpoints),
            packing.pack(_log_entry(problem, state, after, dense)),
        )
        return after, pieces, jnp.where(keep, count + 1, count)

    carry = _resume(start), pieces, jnp.zeros_like(stride)
    _, pieces, count = lax.while_loop(lambda carry: any_in_batch(carry[0].is_running(shorter)), body, carry)
    return pieces, jnp.where(stride > 1, count, 1)


def _last_in_use(rows_bar):
    """Number of the last row with a cotangent other than zero, -1 for none."""
    used = jax.vmap(_any_nonzero)(rows_bar)
    return jnp.max(jnp.where(used, jnp.arange(len(used), dtype=jnp.int32), -1))


def _leads_to_jump(row, last_jump):
    """True for a step up to a jump both sides of which are used."""
    return False if last_jump is None else row[0][5].actions <= last_jump


def _any_nonzero(bars):
    """True if some number is not zero."""
    return jnp.any(jnp.stack([jnp.any(x != 0.0) for x in jax.tree.leaves(bars)]))


def _with_zeros(bars, like):
    """Cotangents, with zeros where there are none."""
    found = [jnp.zeros_like(x) if bar is None else bar for x, bar in zip(*map(_leaves, (like, bars)), strict=True)]
    return jax.tree.unflatten(jax.tree.structure(like), found)


def _leaves(tree):
    return jax.tree.leaves(tree, is_leaf=lambda x: x is None)
