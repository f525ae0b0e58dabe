"""Newton's method with a line search on the equations of a cycle."""

import dataclasses
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array, lax

from ..assembly._state import State
from ..model._system import System
from ..ode._loop import stop_gradients
from ..runtime import lapack
from ._chart import Chart
from ._shooting import Shooting

_MOST_STEPS = 60  # trials of the line search included
_LARGEST_CHANGE = 0.3  # of the period in one step, of its logarithm
_LEAST_LENGTH = 1e-4  # of a step that is tried
_SUFFICIENT_DECREASE = 0.1  # share of the decrease that the slope predicts, at which a trial is taken (Armijo)
_SINGULAR = {8: 3e-8, 4: 1e-4}  # of the largest singular value: below is none, but for errors of the motions
#: Least tolerance of the motions of the search: corrections that follow have the tolerances asked for.
_TOLERANCE = {8: 1e-9, 4: 3e-5}
#: Largest step that is the last one: the slope at its begin serves for the corrections and for derivatives.
_LAST_STEP = {8: 1e-7, 4: 1e-2}


def inverse_of(J: Array) -> Array:
    """The inverse of a slope J of which there may be more rows than columns, without derivative.

    Directions in which it is singular, as where the cycle is one of many, are left out.
    """
    U, s, Vh = lapack.svd(lax.stop_gradient(J))
    used = s > _SINGULAR[J.dtype.itemsize] * jnp.max(s, initial=0.0)
    return Vh.T @ (jnp.where(used, 1.0 / jnp.where(used, s, 1.0), 0.0)[:, None] * U.T)


class NewtonSearch(NamedTuple):
    """A Newton search: the point taken last with its step, and the one to be tried.

    `loss` () is half the square of the rows, `descent` () its slope along the step, `length` () the share of the step
    that leads to the trial.
    """

    trials: Array
    states: State
    period: Array
    loss: Array
    descent: Array
    step: Array
    length: Array
    inverse: Array
    is_singular: Array
    charts: Chart
    trial_states: State
    trial_period: Array
    is_last: Array


def search(shooting: Shooting, system: System, states: State, period: Array, least: int) -> NewtonSearch:
    """Newton's method with a backtracking line search from states (m,) and a period, until its steps are small.

    Args: least: see `Flow.end`, for slopes where the motion itself is at rest.
    """
    shooting, system, states, period = stop_gradients((shooting, system, states, period))
    once = _iteration(_with_tolerance(shooting, _TOLERANCE[period.dtype.itemsize]), system, least)

    def goes_on(s):
        usable = jnp.all(jnp.isfinite(s.step)) & (s.length >= _LEAST_LENGTH)
        return ~s.is_last & (s.trials < _MOST_STEPS) & usable

    charts = shooting.charts(system, states, period)
    n, h = shooting.segments * charts.num_numbers, shooting.held.number
    free, infinite = int(shooting.is_free), jnp.asarray(jnp.inf, period.dtype)
    none, inverse = jnp.zeros(n + free, period.dtype), jnp.zeros((n + free, n + h), period.dtype)
    no, one = jnp.asarray(False), jnp.ones_like(infinite)
    first = NewtonSearch(
        jnp.zeros((), jnp.int32),
        *(states, period, infinite, infinite, none, one, inverse, no, charts, states, period, no),
    )
    return lax.while_loop(goes_on, once, first)


def _iteration(shooting, system, least):
    """Function of a search that gives the next one."""

    def moved(charts, period, z):
        free = int(shooting.is_free)
        xi = (z[: z.shape[0] - free] if free else z).reshape(shooting.segments, -1)
        longer = period * jnp.exp(z[-1]) if free else period
        return shooting.states(system, charts, xi, longer), longer

    def once(s):
        charts = shooting.charts(system, s.trial_states, s.trial_period)
        linear = shooting.linearised(system, charts, s.trial_period, least)
        loss, J = 0.5 * jnp.sum(linear.rows**2), linear.matrix
        inverse = inverse_of(J)
        step = -inverse @ linear.rows
        descent, whole = linear.rows @ (J @ step), jnp.ones_like(loss)
        if shooting.is_free:
            whole = jnp.minimum(1.0, _LARGEST_CHANGE / jnp.maximum(jnp.abs(step[-1]), 1e-30))
        nearer = loss <= s.loss + _SUFFICIENT_DECREASE * s.length * s.descent
        small = jnp.max(jnp.abs(step), initial=0.0) <= _LAST_STEP[s.period.dtype.itemsize]
        better = (s.trials == 0) | nearer | (small & jnp.isfinite(loss))
        taken = (s.trial_states, s.trial_period, loss, descent, step, whole, inverse, linear.is_singular, charts)
        kept = (s.states, s.period, s.loss, s.descent, s.step, 0.5 * s.length, s.inverse, s.is_singular, s.charts)
        chosen = jax.tree.map(lambda a, b: jnp.where(better, a, b), taken, kept)
        _, period, *_, step, length, _, _, charts = chosen
        trial = moved(charts, period, length * step)
        return NewtonSearch(s.trials + 1, *chosen, *trial, better & small)

    return once


def _with_tolerance(shooting, least):
    """The same equations of motions with no smaller tolerances than one."""
    flow = shooting.flow
    rtol, atol = (jnp.maximum(jnp.asarray(x), least) for x in (flow.rtol, flow.atol))
    return dataclasses.replace(shooting, flow=dataclasses.replace(flow, rtol=rtol, atol=atol))
