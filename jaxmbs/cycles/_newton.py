"""The search for a cycle: Newton's method, whose slope Broyden's secants keep for as long as steps shrink with it.

A slope costs as many motions as the mechanism has freedoms, a step without one a motion.
Source: Dennis and Schnabel, Numerical methods for unconstrained optimization and nonlinear equations (1996), 8.
"""

import dataclasses
from typing import NamedTuple

import jax.numpy as jnp
from jax import Array, lax

from ..assembly._state import State
from ..model._system import System
from ..ode._loop import stop_gradients
from ..ode._named_solver import is_implicit
from ._chart import quickest
from ._secant import GOES_ON, LAST, LOST, SecantSteps
from ._shooting import Shooting

_MOST_MOTIONS = 100  # trials of the line search included
#: Tolerances of the motions whose slopes are taken: the finest, and that of the first; between, a share of the square
#: of the last step, as Newton's method leaves that.
FINE, _COARSE, _OF_SQUARE = {8: 1e-9, 4: 3e-5}, {8: 1e-5, 4: 1e-3}, 1e-3
_LEAST_TOLERANCE = 1e-14
#: Errors of the place at which the search ends, of the size of the motion.
_ENOUGH, _OF_TOLERANCE = {8: 1e-10, 4: 3e-4}, 0.1
#: Least steps of a motion over the period, and in a time in which small deviations change by their size: with half a
#: one Dopri8 misses a hundredth of them, which secants mend.
_LEAST_STEPS, _STEPS_BY_RATE = 24, 0.5


class NewtonSearch(NamedTuple):
    """A point of a search: states (m,) at the begins of the segments, and the period.

    `tolerance` () is that of the next slope; `state` () tells whether the search goes on, has ended, or is lost.
    """

    motions: Array
    tolerance: Array
    states: State
    period: Array
    state: Array

    @property
    def is_last(self) -> Array:
        """True () where the search ended at a cycle."""
        return self.state == LAST


def search(shooting: Shooting, system: System, states: State, period: Array, least: int) -> NewtonSearch:
    """The cycle near states (m,) and a period, without derivatives.

    Args: least: most of the least number of steps of a motion, see `Flow.end`.
    """
    shooting, system, states, period = stop_gradients((shooting, system, states, period))
    charts = shooting.charts(system, states, period)
    once = _round(shooting, system, _least_steps(shooting, system, charts, period, least))
    coarse, zero = jnp.full_like(period, _COARSE[period.dtype.itemsize]), jnp.zeros((), jnp.int32)
    goes_on = lambda s: (s.state == GOES_ON) & (s.motions < _MOST_MOTIONS)
    return lax.while_loop(goes_on, once, NewtonSearch(zero, coarse, states, period, zero + GOES_ON))


def _least_steps(shooting, system, charts, period, most):
    """Least number () of steps over a segment, for a slope that the search takes."""
    least = jnp.asarray(_LEAST_STEPS, period.dtype)
    if not is_implicit(shooting.flow.solver):
        least = jnp.maximum(least, _STEPS_BY_RATE * period * quickest(system, charts))
    return jnp.minimum(jnp.where(jnp.isfinite(least), least, jnp.inf) / shooting.segments, most)


def _round(shooting, system, least):
    """Function of a search that gives the next: a slope at its point, and steps for as long as they shrink."""
    asked = jnp.minimum(jnp.min(shooting.flow.rtol), jnp.min(shooting.flow.atol))
    loosest = jnp.maximum(jnp.max(shooting.flow.rtol), jnp.max(shooting.flow.atol))

    def once(s):
        bytes_ = s.period.dtype.itemsize
        charts = shooting.charts(system, s.states, s.period)
        linear = with_tolerance(shooting, s.tolerance).linearised(system, charts, s.period, least)
        size = shooting.size(system, charts)
        enough = jnp.maximum(_ENOUGH[bytes_] * jnp.minimum(1.0, size), _OF_TOLERANCE * loosest)

        def rows(z, tolerance):
            return with_tolerance(shooting, tolerance).rows(system, charts, *shooting.parts(z, s.period), "forward")

        steps = SecantSteps.begin(
            linear, s.tolerance, jnp.maximum(asked, _LEAST_TOLERANCE), s.tolerance <= FINE[bytes_], s.motions
        )
        longest = shooting.longest_step(steps.z.shape[0])
        steps = lax.while_loop(lambda c: c.state == GOES_ON, lambda c: c.next(rows, enough, longest), steps)
        states, period = shooting.displaced_states(system, charts, s.period, steps.z)
        fine = FINE[bytes_]
        squared = jnp.clip(_OF_SQUARE * steps.size**2, fine, jnp.maximum(s.tolerance, fine))
        tolerance = jnp.where(steps.is_refused, fine, squared)
        lost = (steps.state == LOST) | ~jnp.isfinite(period)
        state = jnp.where(steps.state == LAST, LAST, jnp.where(lost, LOST, GOES_ON))
        return NewtonSearch(steps.motions + 1, tolerance, states, period, state.astype(s.state.dtype))

    return once


def with_tolerance(shooting: Shooting, least: Array) -> Shooting:
    """The same equations of motions with no smaller tolerances than one."""
    flow = shooting.flow
    rtol, atol = (jnp.maximum(jnp.asarray(x), least) for x in (flow.rtol, flow.atol))
    return dataclasses.replace(shooting, flow=dataclasses.replace(flow, rtol=rtol, atol=atol))
