"""Continuation of cycles by arclength: steps along a branch, predicted by its tangent, corrected by Newton's method.

Unknowns are the states at the begins of the segments, the parameter and, where it is free, the period.  Corrections
are the shortest ones, so that folds are points as any other.  Source: Keller, Numerical solution of bifurcation and
nonlinear eigenvalue problems (1977); Allgower and Georg, Numerical continuation methods (1990).
"""

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array, lax

from ..assembly._state import State
from ..runtime import jit, lapack
from ._chart import Chart
from ._cycle import Cycle
from ._implicit import Solution
from ._periodic import CycleProblem, cycle_of

_MOST_CORRECTIONS = 8
_LAST_CORRECTION = 1e-7  # its square is below rounding


class Family(eqx.Module):
    """The cycles of systems that depend on a parameter.

    Attributes:
        problem: their equations; span: () of the parameter, its unit along the branch.
        system_of, period_of: functions of the parameter (static); the latter None where the period is free.
    """

    problem: CycleProblem
    span: Array
    system_of: Callable = eqx.field(static=True)
    period_of: Callable | None = eqx.field(static=True)

    def period(self, value: Array, before: Array) -> Array:
        """The period [s] at a value of the parameter; the one before where it is free."""
        return before if self.period_of is None else self.period_of(value)


class BranchPlace(NamedTuple):
    """A cycle on a branch.

    Attributes:
        value: () of the parameter; states (m,); period () [s]; charts (m,) of the states.
        tangent: (m n + 0 or 1 + 1,) of unit length: numbers of the charts over the size, the logarithm of the period
            where it is free, the parameter over its span.
        size: () of the motion; turn: () cosine between this tangent and the one before.
        corrections: () their number; found: () true where they ended; is_singular: () see `Cycle`.
    """

    value: Array
    states: State
    period: Array
    charts: Chart
    tangent: Array
    size: Array
    turn: Array
    corrections: Array
    found: Array
    is_singular: Array


@jit
def first_place(family: Family, value: Array, states: State, period: Array, size: Array, sense: Array) -> BranchPlace:
    """The place of a cycle, whose tangent leads to larger values of the parameter where sense is positive."""
    shooting = family.problem.shooting
    charts = shooting.charts(family.system_of(value), states, period)
    number = states.t.shape[0] * charts.num_numbers + int(shooting.is_free) + 1
    towards = jnp.zeros(number, period.dtype).at[-1].set(sense)
    zero, yes, no = jnp.zeros((), jnp.int32), jnp.asarray(True), jnp.asarray(False)
    place = BranchPlace(value, states, period, charts, towards, size, sense, zero, yes, no)
    return _corrected(family, place)


@jit
def next_place(family: Family, place: BranchPlace, length: Array) -> BranchPlace:
    """The place at a length along the tangent from another one, corrected."""
    value, states, period = _step_from(family, place, length * place.tangent)
    charts = family.problem.shooting.charts(family.system_of(value), states, period)
    return _corrected(family, place._replace(value=value, states=states, period=period, charts=charts), place)


@jit
def cycle_at(family: Family, place: BranchPlace) -> Cycle:
    """The cycle at a place, with its multipliers."""
    found = Solution(place.states, place.period, place.found, place.is_singular)
    return cycle_of(family.system_of(place.value), family.problem, found, place.period, "reverse")


def with_size(place: BranchPlace, size: Array) -> BranchPlace:
    """The same place with another unit of its states."""
    free = 1 + int(place.tangent.shape[0] > _num_numbers(place) + 1)
    tangent = jnp.concatenate([place.tangent[:-free] * place.size / size, place.tangent[-free:]])
    return place._replace(size=jnp.asarray(size), tangent=tangent / jnp.sqrt(jnp.sum(tangent**2)))


def directions(place: BranchPlace) -> Array:
    """The tangent of a place, in coordinates that all charts share."""
    charts, m = place.charts, place.charts.state.t.shape[0]
    number = _num_numbers(place)
    xi = place.tangent[:number].reshape(m, -1)
    a, b = charts.positions.shape[-1], charts.positions.shape[-1] + charts.velocities.shape[-1]
    both = [charts.positions @ xi[:, :a, None], charts.velocities @ xi[:, a:b, None], xi[:, b:, None]]
    return jnp.concatenate([*(x.reshape(-1) for x in both), place.tangent[number:]])


def _num_numbers(place):
    return place.charts.state.t.shape[0] * place.charts.num_numbers


def _step_from(family, place, y):
    """Value, states and period a step y of the unknowns away from a place."""
    shooting, m = family.problem.shooting, place.states.t.shape[0]
    number = _num_numbers(place)
    value = place.value + family.span * y[-1]
    period = place.period * jnp.exp(y[number]) if shooting.is_free else family.period(value, place.period)
    xi = (place.size * y[:number]).reshape(m, -1)
    return value, shooting.states(family.system_of(value), place.charts, xi, period), period


def _corrected(family, place, before=None):
    """A place after corrections, its tangent in the sense of the one before."""
    shooting = family.problem.shooting

    def once(s):
        place, _ = s
        charts = shooting.charts(family.system_of(place.value), place.states, place.period)
        place = place._replace(charts=charts)
        rows, J, is_singular = _rows_and_slope(family, place)
        step, tangent = _shortest(J, -rows)
        value, states, period = _step_from(family, place, step)
        small = jnp.max(jnp.abs(step)) <= _LAST_CORRECTION
        place = place._replace(value=value, states=states, period=period, tangent=tangent, found=small)
        place = place._replace(corrections=place.corrections + 1, is_singular=is_singular)
        return place, jnp.max(jnp.abs(step))

    def goes_on(s):
        place, size = s
        return ~place.found & (place.corrections < _MOST_CORRECTIONS) & (size < 1.0)

    start = place._replace(corrections=jnp.zeros((), jnp.int32), found=jnp.asarray(False))
    last = lax.while_loop(goes_on, once, (start, jnp.zeros((), place.value.dtype)))[0]
    turn = directions(last) @ directions(place if before is None else before)
    sense = jnp.where(turn < 0.0, -1.0, 1.0).astype(turn.dtype)
    return last._replace(tangent=sense * last.tangent, turn=jnp.abs(turn))


def _rows_and_slope(family, place):
    """Rows (N,) of a place, their slopes (N, m n + 0 or 1 + 1) by steps of the unknowns, and if those of the cycle
    alone are singular."""
    shooting, m = family.problem.shooting, place.states.t.shape[0]
    linear = shooting.linearised(family.system_of(place.value), place.charts, place.period)
    still = jnp.zeros((m, place.charts.num_numbers), place.period.dtype)
    least = family.problem.steps // m

    def rows(value):
        period = family.period(value, place.period)
        return shooting.rows(family.system_of(value), place.charts, still, period, "forward", least)

    by_value = jax.jvp(rows, (place.value,), (family.span,))[1]
    number, J = still.size, linear.matrix
    parts = [J[:, :number] * place.size, J[:, number:], by_value[:, None]]
    return linear.rows, jnp.concatenate(parts, axis=1), linear.is_singular


def _shortest(J, right):
    """The shortest y of `J y = right` of one unknown more than there are independent rows, and the direction that
    changes none of them."""
    short = jnp.zeros((max(J.shape[1] - J.shape[0], 0), J.shape[1]), J.dtype)
    U, s, Vh = lapack.svd(jnp.concatenate([J, short]))
    used = s[:-1] > 1e-13 * s[0]
    part = jnp.where(used, (U.T @ jnp.concatenate([right, short[:, 0]]))[:-1] / jnp.where(used, s[:-1], 1.0), 0.0)
    return Vh[:-1].T @ part, Vh[-1]
