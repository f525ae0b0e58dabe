"""Newton's method with a line search on the equations of a cycle."""

import dataclasses
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array, lax

from ..assembly._state import State
from ..model._system import System
from ..ode._loop import stop_gradients
from ..ode._named_solver import is_implicit
from ._chart import Chart, quickest
from ._folds import FoldProbe
from ._shooting import Shooting

_MOST_STEPS = 60  # trials of the line search included
_LARGEST_CHANGE = 0.3  # of the period in one step, of its logarithm
_LEAST_LENGTH = 1e-4  # of a step that is tried
_SUFFICIENT_DECREASE = 0.1  # share of the decrease that the slope predicts, at which a trial is taken (Armijo)
#: Tolerances of the motions of the search: that of the last step, after which corrections with the tolerances asked
#: for follow, and that of the first; between, a share of the square of the last step, as Newton's method leaves that.
_FINE, _COARSE, _OF_SQUARE = {8: 1e-9, 4: 3e-5}, {8: 1e-5, 4: 1e-3}, 1e-3
_NOISE = 100.0  # of tolerances: rows that are smaller need not decrease
#: Step that is the last one where the slope is as good as its inverse needs; one that is the last in any case.
_GOOD_STEP, _LAST_STEP, _REGULAR = {8: 1e-6, 4: 1e-2}, {8: 1e-7, 4: 1e-2}, 0.1
#: Least steps of a motion over the period, and in a time in which small deviations change by their size.
_LEAST_STEPS, _STEPS_BY_RATE = 24, 2.0


class NewtonSearch(NamedTuple):
    """A Newton search: the point taken last with its step, and the one to be tried.

    `loss` () is half the square of the rows, `descent` () its slope along the step, `length` () the share of the step
    that leads to the trial, `tolerance` () that of its motion, `least` () the least singular value of the slope.
    """

    trials: Array
    tolerance: Array
    states: State
    period: Array
    loss: Array
    descent: Array
    step: Array
    length: Array
    inverse: Array
    least: Array
    charts: Chart
    trial_states: State
    trial_period: Array
    is_last: Array
    probe: FoldProbe

    @property
    def is_singular(self) -> Array:
        """True () where the cycle is one of many, or so near a fold that its slopes are not known."""
        size = jnp.max(jnp.abs(self.step), initial=0.0)
        return self.probe.is_at_fold(self.least, size + _FINE[size.dtype.itemsize] / self.least)


def search(shooting: Shooting, system: System, states: State, period: Array, least: int) -> NewtonSearch:
    """Newton's method with a backtracking line search from states (m,) and a period, until its steps are small.

    Args: least: most of the least number of steps of a motion, see `Flow.end`.
    """
    shooting, system, states, period = stop_gradients((shooting, system, states, period))
    charts = shooting.charts(system, states, period)
    bytes_ = period.dtype.itemsize
    once = _iteration(shooting, system, _least_steps(shooting, system, charts, period, least))

    def goes_on(s):
        usable = jnp.all(jnp.isfinite(s.step)) & (s.length >= _LEAST_LENGTH)
        searches = ~s.is_last & (s.trials < _MOST_STEPS) & usable
        return searches | (s.is_last & s.probe.is_wanted(s.least))

    n, h = shooting.segments * charts.num_numbers, shooting.held.number
    free, infinite = int(shooting.is_free), jnp.asarray(jnp.inf, period.dtype)
    none, inverse = jnp.zeros(n + free, period.dtype), jnp.zeros((n + free, n + h), period.dtype)
    coarse, one = jnp.full_like(infinite, _COARSE[bytes_]), jnp.ones_like(infinite)
    first = NewtonSearch(
        jnp.zeros((), jnp.int32),
        *(coarse, states, period, infinite, infinite, none, one, inverse, infinite, charts, states, period),
        *(jnp.asarray(False), FoldProbe.none(none)),
    )
    return lax.while_loop(goes_on, once, first)


def _least_steps(shooting, system, charts, period, most):
    """Least number () of steps over a segment."""
    least = jnp.asarray(_LEAST_STEPS, period.dtype)
    if not is_implicit(shooting.flow.solver):
        least = jnp.maximum(least, _STEPS_BY_RATE * period * quickest(system, charts))
    return jnp.minimum(jnp.where(jnp.isfinite(least), least, jnp.inf) / shooting.segments, most)


def _iteration(shooting, system, least):
    """Function of a search that gives the next one."""

    def moved(charts, period, z):
        free = int(shooting.is_free)
        xi = (z[: z.shape[0] - free] if free else z).reshape(shooting.segments, -1)
        longer = period * jnp.exp(z[-1]) if free else period
        return shooting.states(system, charts, xi, longer), longer

    def once(s):
        bytes_ = s.period.dtype.itemsize
        charts = shooting.charts(system, s.trial_states, s.trial_period)
        linear = _with_tolerance(shooting, s.tolerance).linearised(system, charts, s.trial_period, least)
        loss, parts = 0.5 * jnp.sum(linear.rows**2), linear.decomposition
        inverse = parts.inverse
        step = -inverse @ linear.rows
        size, whole = jnp.max(jnp.abs(step), initial=0.0), jnp.ones_like(loss)
        if shooting.is_free:
            whole = jnp.minimum(1.0, _LARGEST_CHANGE / jnp.maximum(jnp.abs(step[-1]), 1e-30))
        nearer = loss <= s.loss + _SUFFICIENT_DECREASE * s.length * s.descent
        noise = loss <= (_NOISE * s.tolerance) ** 2
        good = size <= _GOOD_STEP[bytes_] * jnp.minimum(1.0, (parts.least / _REGULAR) ** 2)
        small = (good | (size <= _LAST_STEP[bytes_])) & jnp.isfinite(loss)
        better = ~s.is_last & ((s.trials == 0) | nearer | small | noise)
        descent = linear.rows @ (linear.matrix @ step)
        taken = (s.trial_states, s.trial_period, loss, descent, step, whole, inverse, parts.least, charts)
        kept = (s.states, s.period, s.loss, s.descent, s.step, 0.5 * s.length, s.inverse, s.least, s.charts)
        chosen = jax.tree.map(lambda a, b: jnp.where(better, a, b), taken, kept)
        fine = _FINE[bytes_]
        is_last = s.is_last | (better & small & (s.tolerance <= fine))
        tolerance = jnp.clip(_OF_SQUARE * size**2, fine, s.tolerance)
        probe = s.probe.after(s.is_last, s.least, parts.least, parts.direction)
        return _next(s, chosen, better, is_last, tolerance, probe, moved)

    return once


def _next(s, chosen, better, is_last, tolerance, probe, moved):
    """The search with the point chosen, its next trial and its tolerance.

    A trial that is refused leads to a shorter one; where the tolerance is coarse, first to the same point with the
    fine one.
    """
    states, period, loss, descent, step, length, inverse, least, charts = chosen
    fine = _FINE[period.dtype.itemsize]
    again = ~better & ~is_last & (s.tolerance > fine)
    z = jnp.where(is_last, step + probe.displacement, length * step)
    trial = moved(charts, period, jnp.where(again, 0.0, z))
    tolerance = jnp.where(again | is_last, fine, jnp.where(better, tolerance, s.tolerance))
    loss, length = jnp.where(again, jnp.inf, loss), jnp.where(again, 2.0 * length, length)
    at = states, period, loss, descent, step, length, inverse, least, charts
    return NewtonSearch(s.trials + 1, tolerance, *at, *trial, is_last, probe)


def _with_tolerance(shooting, least):
    """The same equations of motions with no smaller tolerances than one."""
    flow = shooting.flow
    rtol, atol = (jnp.maximum(jnp.asarray(x), least) for x in (flow.rtol, flow.atol))
    return dataclasses.replace(shooting, flow=dataclasses.replace(flow, rtol=rtol, atol=atol))
