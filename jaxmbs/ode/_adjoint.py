"""Reverse derivatives of a march: exact for the steps that were taken, their times held.

The start of every accepted step is logged, with the stages of explicit Runge-Kutta methods.  When the log is full it
keeps every second one, then every fourth; from each of those the steps up to the next are taken once more before they
are pulled back.  So memory is bounded by two logs of `march.rows` steps, whatever the length of the motion.
"""

import functools

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array

from ..runtime import Packing, any_lane, small_call
from ._loop import LoopState, OdeProblem, attempt_step, begin, ended, first_of_duplicates, integrate, set_row
from ._step_vjp import first_memory, has_stages, memory_of, step_vjp


class CheckpointBuffer(eqx.Module):
    """Rows (rows + 1, numbers) of the accepted steps with a number that is a multiple of `stride`; number -1: free.

    Rows are packed into vectors.  The last one takes what is not kept.
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

    def noted(self, row, keep):
        """The log after a step that is in it if `keep`."""
        size = self.numbers.size - 1
        stride = jnp.where(keep & (self.count == size * self.stride), 2 * self.stride, self.stride)
        free = jnp.where(self.count < size, self.count, _first(self.numbers[:-1] % stride != 0))
        slot = jnp.where(keep & (self.count % stride == 0), free, size)
        count = jnp.where(keep, self.count + 1, self.count)
        return CheckpointBuffer(
            set_row(self.rows, slot, row), set_row(self.numbers, slot, self.count), stride, count, self.packing
        )

    def at(self, number):
        """The row of a step that is in the log."""
        slot = jnp.where(self.stride == 1, jnp.maximum(number, 0), _first(self.numbers[:-1] == number))
        return _row(self.rows, slot)


def _first(found):
    return jnp.argmax(found).astype(jnp.int32)


def _row(rows, index):
    return lax.dynamic_index_in_dim(rows, index, keepdims=False, allow_negative_indices=False)


def _step(march: OdeProblem, walk: LoopState, dense):
    """What is logged of a step: the walk before it, and the inside of a method with stages."""
    before = walk.t, walk.t_next, walk.y, walk.memory, walk.saved, walk.hunt
    return before, dense if has_stages(march.solver) else None


def _packing(march, y0, t0, dt0, args):
    """Of the rows that are logged on a march."""

    def row():
        walk = begin(march, y0, t0, dt0, args)
        return _step(march, walk, attempt_step(march, walk, args)[2])

    return Packing(jax.eval_shape(row), t0.dtype)


def _from(before) -> LoopState:
    """The walk that was logged, to be taken up again; it saves nothing."""
    t, t_next, y, memory, saved, hunt = before
    zero = jnp.zeros_like(saved)
    result = jax.tree.map(jnp.asarray, diffrax.RESULTS.successful)
    return LoopState(t, t_next, y, memory, result, zero, zero, saved, None, None, hunt, None)


@eqx.filter_custom_vjp
def integrate_with_adjoint(start, march: OdeProblem, t0, dt0) -> LoopState:
    """`integrate` from start = (y0, args), with a reverse derivative by them."""
    y0, args = start
    return integrate(march, y0, t0, dt0, args)


@integrate_with_adjoint.def_fwd
def _forward(perturbed, start, march, t0, dt0):
    del perturbed
    y0, args = start
    first = begin(march, y0, t0, dt0, args)
    packing = _packing(march, y0, t0, dt0, args)

    def body(carry):
        walk, log = carry
        after, keep, dense = attempt_step(march, walk, args)
        return after, log.noted(packing.pack(_step(march, walk, dense)), keep)

    running = lambda carry: any_lane(carry[0].is_running(march))  # noqa: E731
    steps = functools.partial(lax.while_loop, running, body)
    walk, log = small_call(steps)((first, CheckpointBuffer.empty(packing, march.rows)))
    walk = ended(march, walk)
    return walk, (log, walk.t, first.saved, walk.saved)


@integrate_with_adjoint.def_bwd
def _backward(kept, bars, perturbed, start, march, t0, dt0):
    (log, t_end, skipped, saved), (y0, args) = kept, start
    moving = jax.tree.map(lambda x, p: p and eqx.is_inexact_array(x), args, perturbed[1])
    moving, fixed = eqx.partition(args, moving)
    packing, numbers = log.packing, Packing(moving, t0.dtype)

    def args_of(vector):
        return eqx.combine(numbers.unpack(vector), fixed)

    moving = numbers.pack(moving)
    y_bar, shown_bar = _filled(bars.y, y0), _filled(bars.shown, y0) if march.shows else None
    ys_bar = _filled(bars.ys, jax.tree.map(lambda y: jnp.broadcast_to(y[None], (march.times.size, *y.shape)), y0))
    ys_bar = jax.tree.map(lambda ys: jnp.zeros_like(ys).at[first_of_duplicates(march)].add(ys), ys_bar)
    last = jnp.where(log.count > 0, (log.count - 1) // log.stride, -1)

    def segment(carry):
        number, end, pieces, bars = carry
        row = log.at(number * log.stride)
        start = packing.unpack(row)[0]
        pieces, count = _again(march, args, packing, row, jnp.where(number >= 0, end, start[0]), pieces, log.stride)
        count = jnp.where(number >= 0, count, 0)

        def one(carry):
            k, bars = carry
            row = packing.unpack(_row(pieces, jnp.maximum(k, 0)))
            found = step_vjp(march, args_of, moving, row, bars, ys_bar)
            counts = (k >= 0) & (is_used | (row[0][4] <= last_used))
            return k - 1, jax.tree.map(lambda new, old: jnp.where(counts, new, old), found, bars)

        bars = lax.while_loop(lambda carry: any_lane(carry[0] >= 0), one, (count - 1, bars))[1]
        return number - 1, start[0], pieces, bars

    memory = jax.tree.map(jnp.zeros_like, memory_of(march, packing.unpack(log.rows[0])[0][3]))
    # steps after the last state that is used are left out: one that is not finite would make NaN of zeros
    index = jnp.arange(march.times.size, dtype=jnp.int32)
    is_used, last_used = _any((y_bar, shown_bar)), jnp.max(jnp.where(_used(ys_bar), index, -1))
    begun = (last, t_end, jnp.zeros_like(log.rows), (jnp.zeros_like(moving), y_bar, memory, shown_bar))
    bars = lax.while_loop(lambda carry: any_lane(carry[0] >= 0), segment, begun)[3]
    moving_bar, y_bar = first_memory(march, y0, t0, dt0, args_of, moving, bars[:3])
    rest = (index < skipped) | (index >= saved)  # they are the start: saved before the first step, or never

    def with_rest(y_bar, ys_bar):
        return y_bar + jnp.sum(jnp.where(rest.reshape(-1, *[1] * (ys_bar.ndim - 1)), ys_bar, 0.0), axis=0)

    return jax.tree.map(with_rest, y_bar, ys_bar), numbers.unpack(moving_bar)


def _again(march, args, packing, row, end, pieces, stride):
    """(rows of the steps from a logged one to the time `end`, their number); a step that is logged itself is taken
    over."""
    start, pieces = packing.unpack(row)[0], set_row(pieces, jnp.zeros((), jnp.int32), row)
    to = lax.stop_gradient(jnp.where(stride > 1, end, start[0]))  # rows have derivatives, times none
    shorter = eqx.tree_at(
        lambda m: (m.t1, m.max_steps, m.meter),
        march,
        (to, jnp.asarray(jnp.iinfo(march.max_steps.dtype).max, march.max_steps.dtype), diffrax.NoProgressMeter()),
    )

    def body(carry):
        walk, pieces, count = carry
        after, keep, dense = attempt_step(shorter, walk, args)
        pieces = set_row(pieces, jnp.where(keep, count, march.rows), packing.pack(_step(march, walk, dense)))
        return after, pieces, jnp.where(keep, count + 1, count)

    carry = _from(start), pieces, jnp.zeros_like(stride)
    _, pieces, count = lax.while_loop(lambda carry: any_lane(carry[0].is_running(shorter)), body, carry)
    return pieces, jnp.where(stride > 1, count, 1)


def _used(ys_bar):
    """(T,) whether a saved state has a cotangent."""
    return jax.vmap(_any)(ys_bar)


def _any(bars):
    """Whether some number is not zero."""
    return jnp.any(jnp.stack([jnp.any(x != 0.0) for x in jax.tree.leaves(bars)]))


def _filled(bars, like):
    """Cotangents, zeros where there are none."""
    found = [jnp.zeros_like(x) if bar is None else bar for x, bar in zip(*map(_leaves, (like, bars)), strict=True)]
    return jax.tree.unflatten(jax.tree.structure(like), found)


def _leaves(tree):
    return jax.tree.leaves(tree, is_leaf=lambda x: x is None)
