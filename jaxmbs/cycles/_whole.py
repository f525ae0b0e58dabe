"""The motion over a whole cycle from the states at the begins of its segments, and what it misses."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..assembly._state import State
from ..model._system import System
from ..motion._diagnostics import Diagnostics
from ..motion._motion import Motion
from ._chart import Chart, accelerations_and_rates
from ._shooting import Shooting

#: Size of a motion, of the length of the system, below which what its end misses is not measured by it: a machine at
#: rest under steady forces is a cycle of any period.
_LEAST_SIZE = 1e-4
_MOST_REPEATS, _SAME = (
    8,
    {8: 1e-5, 4: 1e-2},
)  # of a motion within its period; gap over its size at which states are the same
#: Parts of a cycle of which each has its own slope: small multipliers keep their digits.
_LEAST_PARTS = 8


def parts_of(segments: int, in_one: bool) -> int:
    """Number of parts whose slopes make the multipliers; in_one: a cycle with events, or samples, is not cut."""
    return segments if in_one else segments * -(-_LEAST_PARTS // segments)


def motion_of_segments(
    shooting: Shooting, system: System, begins: State, period: Array, steps: int, gradient: str
) -> Motion:
    """The motion over the cycle, of one begun anew at every segment.  Args: steps: saved intervals of a segment."""
    times = shooting.times(period)

    def one(state, t0, t1):
        share = jnp.asarray(np.arange(steps + 1) / steps, t0.dtype)
        return shooting.flow.motion(system, state, t0 + (t1 - t0) * share, gradient)

    if shooting.segments == 1:
        return one(jax.tree.map(lambda x: x[0], begins), times[0], times[1])
    return _joined(lax.map(lambda x: one(*x), (begins, times[:-1], times[1:])))


def _joined(motions: Motion) -> Motion:
    """One motion of several (m,) that follow each other."""

    def rows(x):
        """(m, K + 1, ...) as (m K + 1, ...)."""
        return jnp.concatenate([x[:, :-1].reshape(x.shape[0] * (x.shape[1] - 1), *x.shape[2:]), x[-1, -1:]])

    def summed(x):
        """The same of what begins at zero in each."""
        before = jnp.concatenate([jnp.zeros_like(x[:1, -1]), jnp.cumsum(x[:-1, -1], axis=0)])
        return rows(x + before[:, None])

    d = motions.diagnostics
    accounts = Diagnostics(
        kinetic=rows(d.kinetic),
        potential=rows(d.potential),
        work=jax.tree.map(summed, d.work),
        energy_residual=summed(d.energy_residual),
        constraint_drift=rows(d.constraint_drift),
        velocity_drift=rows(d.velocity_drift),
        num_steps=jnp.sum(d.num_steps),
        num_rejected=jnp.sum(d.num_rejected),
        stiffening=jax.tree.map(rows, d.stiffening),
    )
    end = jax.tree.map(lambda x: x[-1], motions.end)
    states = jax.tree.map(rows, motions.states)
    return Motion(rows(motions.ts), states, jnp.max(motions.result), accounts, end, solver=motions.solver)


def residuals(shooting: Shooting, system: System, motion: Motion, period: Array) -> tuple[Array, Array]:
    """Gap between the end of a cycle and its begin, over the size of the motion: of states (), and of rates ()."""
    first, last = (jax.tree.map(lambda x, k=k: x[k], motion.states) for k in (0, -1))
    chart = Chart.at(system, first, 2.0 * jnp.pi / period)
    moved, faster = chart.differences(system, last, shooting.gain, shooting.winds)
    gaps = [moved, faster]
    if first.internal is not None and last.internal is not None:
        gaps.append((last.internal.values - first.internal.values) / chart.scale)
    size = size_of_motion(motion, period) + _LEAST_SIZE * system.length
    gap = jnp.max(jnp.stack([_largest(x) for x in gaps]))
    begin, end = (accelerations_and_rates(system, state) for state in (first, last))
    rates = _largest(end - begin) / (_largest(begin) + size * chart.rate**2)
    return gap / size, rates


def repeats(shooting: Shooting, system: System, motion: Motion, period: Array) -> Array:
    """Times () that a motion repeats within the period, of those by which its saved states can be divided, up to
    eight; 1 at rest."""
    chart = Chart.at(system, jax.tree.map(lambda x: x[0], motion.states), 2.0 * jnp.pi / period)
    size, number = size_of_motion(motion, period), len(motion) - 1
    winds = shooting.winds | (shooting.gain != 0.0)
    found = jnp.ones((), jnp.int32)
    for k in (k for k in range(2, _MOST_REPEATS + 1) if number % k == 0):
        state = jax.tree.map(lambda x, k=k: x[number // k], motion.states)
        moved, faster = chart.differences(system, state, jnp.zeros_like(shooting.gain), winds)
        gap = jnp.maximum(_largest(moved), _largest(faster))
        if state.internal is not None and chart.state.internal is not None:
            gap = jnp.maximum(gap, _largest((state.internal.values - chart.state.internal.values) / chart.scale))
        found = jnp.where(gap <= _SAME[size.dtype.itemsize] * size, k, found)
    return jnp.where(size > _LEAST_SIZE * system.length, found, 1).astype(jnp.int32)


def size_of_motion(motion: Motion, period: Array) -> Array:
    """Amplitude () of a sine over the period whose velocity is the largest of the motion [m, rad]."""
    return _largest(motion.states.velocities) * period / (2.0 * np.pi)


def _largest(x):
    return jnp.max(jnp.abs(x), initial=0.0)
