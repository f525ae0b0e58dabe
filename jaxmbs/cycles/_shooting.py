"""Multiple shooting: states at the begin of equal parts of a cycle, each the end of the motion from the one before.

Source: Keller, Numerical methods for two-point boundary-value problems (1968); Seydel, Practical bifurcation and
stability analysis (2010), chapter 7.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..assembly._state import State
from ..math._linalg import full_rank_lstsq
from ..model._system import System
from ..ode._loop import stop_gradients
from ..runtime import jit, lapack
from ._chart import Chart, rate_of_numbers
from ._flow import Flow

_MOST_STEPS = 60  # trials of the line search included
_LARGEST_CHANGE = 0.3  # of the period in one step, of its logarithm
_LEAST_LENGTH = 1e-4  # of a step that is tried
_SUFFICIENT_DECREASE = 0.1  # share of the decrease that the slope predicts, at which a trial is taken (Armijo)
_SINGULAR = {8: 1e-10, 4: 1e-5}  # of the largest singular value: below is none
#: Largest step that is the last: two more, with the slope there, leave its fourth power.
_LAST_STEP = {8: 1e-5, 4: 1e-2}


class StartRows(eqx.Module):
    """Rows beside those of the segments: values that the start keeps.

    Attributes:
        places: of coordinates, velocities and internal states in turn (static).
        values: (h,) that they keep.
        fixes_phase: a row that keeps the phase of a free period: steps of the start are across the motion (static).
    """

    places: tuple[int, ...] = eqx.field(static=True)
    values: Array
    fixes_phase: bool = eqx.field(static=True)

    def rows(self, chart: Chart, state: State) -> Array:
        """Differences (h,) of a start from the values, over their units."""
        places = np.asarray(self.places, int)
        return (numbers_of_state(state)[places] - self.values) / _units(chart)[places]

    @property
    def number(self) -> int:
        return len(self.places) + int(self.fixes_phase)


def numbers_of_state(state: State) -> Array:
    """Coordinates, velocities and internal states in one vector."""
    parts = [state.coordinates, state.velocities]
    return jnp.concatenate(parts if state.internal is None else [*parts, state.internal.values])


def _units(chart):
    ones, rates = jnp.ones_like(chart.state.coordinates), jnp.full_like(chart.state.velocities, chart.rate)
    return jnp.concatenate([ones, rates, chart.scale])


class Shooting(eqx.Module):
    """The equations of a cycle.

    Attributes:
        t0: () its start [s].
        gain: (nv,) of the coordinates over the cycle; winds: (nv,) True for those that count modulo a turn.
        is_free: the period is an unknown (static); segments: number of them (static).
    """

    flow: Flow
    t0: Array
    gain: Array
    winds: Array
    held: StartRows
    is_free: bool = eqx.field(static=True)
    segments: int = eqx.field(static=True)

    def times(self, period: Array) -> Array:
        """Begins and end of the segments (m + 1,) [s]."""
        share = np.arange(self.segments + 1) / self.segments
        return self.t0 + period * jnp.asarray(share, period.dtype)

    def charts(self, system: System, states: State, period: Array) -> Chart:
        """Charts (m, ...) of the states at the begins of the segments."""
        rate = 2.0 * jnp.pi / period
        return jax.vmap(lambda state: Chart.at(system, state, rate))(states)

    def states(self, system: System, charts: Chart, xi: Array, period: Array) -> State:
        """States (m,) of xi (m, n)."""
        return jax.vmap(lambda c, x, t: c.state_at(system, x, t))(charts, xi, self.times(period)[:-1])

    def rows(self, system: System, charts: Chart, xi: Array, period: Array, gradient: str, least: int = 1) -> Array:
        """Gaps between the ends of segments and the begins that follow, and the other rows, (m n + h,).

        Args: least: see `Flow.end`, for derivatives where the motion itself is at rest.
        """
        states, times = self.states(system, charts, xi, period), self.times(period)

        def gap(one):
            chart, start, following, t1, gain = one
            reached = chart.numbers_of(system, self.flow.end(system, start, t1, gradient, least), gain, self.winds)
            return reached - chart.numbers_of(system, following, *self._nothing)

        gaps = lax.map(gap, (_following(charts), states, _following(states), times[1:], self._gains))
        first, start = jax.tree.map(lambda x: x[0], (charts, states))
        return jnp.concatenate([gaps.reshape(-1), self._others(system, first, start, xi[0])])

    @property
    def _gains(self):
        """Gains (m, nv) over each segment: counted in the last."""
        return jnp.zeros((self.segments, *self.gain.shape), self.gain.dtype).at[-1].set(self.gain)

    @property
    def _nothing(self):
        return jnp.zeros_like(self.gain), jnp.zeros_like(self.winds)

    def _others(self, system, chart, start, xi):
        """The other rows (h,) at a start, whose numbers in the chart are xi (n,)."""
        rows = self.held.rows(chart, start)
        if self.held.fixes_phase:
            along = rate_of_numbers(system, chart)
            along = along / jnp.sqrt(jnp.sum(along**2))
            rows = jnp.concatenate([rows, (along @ xi)[None]])
        return rows

    def linearised(self, system: System, charts: Chart, period: Array) -> "Linear":
        """Rows and their slopes at the charts' states."""
        times, gains = self.times(period), self._gains

        def segment(one):
            chart, following, t0, t1, gain = one
            f, G = end_slope(self.flow, system, (chart, following), (t0, t1), gain, self.winds, self.is_free)
            g, H = begin_slope(system, following, following.state.t, self.is_free)
            return f - g, G, H

        after = _following(charts)
        gaps, G, H = lax.map(segment, (charts, after, times[:-1], times[1:], gains))
        n = charts.num_numbers
        by_period = jnp.zeros((self.segments, n, 0), G.dtype)
        if self.is_free:
            late, longer = (times - self.t0)[:-1, None], (times - self.t0)[1:, None]
            begins = jnp.roll(late, -1, axis=0)  # the last segment is followed by the first
            by_period = (G[..., n] * late + G[..., n + 1] * longer - H[..., n] * begins)[..., None]
        first, zero = jax.tree.map(lambda x: x[0], charts), jnp.zeros(n, G.dtype)
        of_start = lambda xi: self._others(system, first, first.state_at(system, xi, self.t0), xi)
        others, E = value_and_slope(of_start, zero)
        E = jnp.concatenate([E, jnp.zeros((E.shape[0], int(self.is_free)), E.dtype)], axis=1)
        return Linear(jnp.concatenate([gaps.reshape(-1), others]), G[..., :n], H[..., :n], by_period, E)


def _following(tree):
    """The rows (m, ...) that follow each, after the last the first."""
    return jax.tree.map(lambda x: jnp.roll(x, -1, axis=0), tree)


@jit
def end_slope(
    flow: Flow,
    system: System,
    charts: tuple[Chart, Chart],
    times: tuple[Array, Array],
    gain,
    winds,
    by_times: bool,
    least: int = 1,
) -> tuple[Array, Array]:
    """Numbers (n,) in a second chart of the end of the motion from a first one's state, and their slopes (n, n).

    Args: by_times: two columns more, by the times of begin and end; least: see `Flow.end`.
    """
    chart, following = charts
    n = chart.num_numbers

    def reached(z):
        t0, t1 = (t + z[n + k] if by_times else t for k, t in enumerate(times))
        end = flow.end(system, chart.state_at(system, z[:n], t0), t1, least=least)
        return following.numbers_of(system, end, gain, winds)

    return value_and_slope(reached, jnp.zeros(n + 2 * int(by_times), gain.dtype))


@jit
def begin_slope(system: System, chart: Chart, t: Array, by_time: bool) -> tuple[Array, Array]:
    """Numbers (n,) of a chart's own states, and their slopes (n, n).  Args: by_time: one column more, by the time."""
    n, none = chart.num_numbers, jnp.zeros_like(chart.state.velocities)

    def own(z):
        state = chart.state_at(system, z[:n], t + z[n] if by_time else t)
        return chart.numbers_of(system, state, none, jnp.zeros(none.shape, bool))

    return value_and_slope(own, jnp.zeros(n + int(by_time), none.dtype))


def value_and_slope(function, z):
    """(value (n,), slope (n, k)) of a function of z (k,), evaluated once."""
    if not z.shape[0]:
        value = function(z)
        return value, jnp.zeros((*value.shape, 0), value.dtype)
    along = lambda direction: jax.jvp(function, (z,), (direction,))
    return jax.vmap(along, out_axes=(None, 1))(jnp.eye(z.shape[0], dtype=z.dtype))


class Linear(NamedTuple):
    """Rows of the segments and the others, and the blocks of their slopes.

    Attributes:
        rows: (m n + h,).
        by_begin, by_next: (m, n, n) of the segments by their begins, and by those that follow.
        by_period: (m, n, 0 or 1) by the logarithm of the period.
        of_others: (h, n + 0 or 1) of the other rows by the first begin and the period.
    """

    rows: Array
    by_begin: Array
    by_next: Array
    by_period: Array
    of_others: Array

    @property
    def matrix(self) -> Array:
        """The whole slope (m n + h, m n + 0 or 1)."""
        m, n, free = self.by_period.shape
        J = jnp.zeros((m, n, m, n), self.rows.dtype)
        k = jnp.arange(m)
        J = J.at[k, :, k].add(self.by_begin).at[k, :, (k + 1) % m].add(-self.by_next)
        top = jnp.concatenate([J.reshape(m * n, m * n), self.by_period.reshape(m * n, free)], axis=1)
        E = self.of_others
        middle = jnp.zeros((E.shape[0], (m - 1) * n), E.dtype)
        return jnp.concatenate([top, jnp.concatenate([E[:, :n], middle, E[:, n:]], axis=1)])


def solve_slope(J: Array, right: Array) -> Array:
    """z of `J z = right`, of which there may be more rows than unknowns; J has no derivative.

    The shortest one where J is singular, as where the cycle is one of many.
    """
    if J.shape[0] != J.shape[1]:
        return full_rank_lstsq(J, right[:, None])[:, 0]
    U, s, Vh = lapack.svd(lax.stop_gradient(J))
    used = s > _SINGULAR[J.dtype.itemsize] * jnp.max(s, initial=0.0)
    return Vh.T @ (jnp.where(used, 1.0 / jnp.where(used, s, 1.0), 0.0) * (U.T @ right))


class Solution(NamedTuple):
    """States (m,) at the begins of the segments, the period, and True where the search ended at a cycle."""

    states: State
    period: Array
    found: Array


def solution(shooting: Shooting, system: System, start: tuple[State, Array], gradient: str, least: int) -> Solution:
    """The cycle near states (m,) and a period, with derivatives by all that the equations depend on.

    The last steps are taken with one fixed slope: each leaves the square of the error, and so they carry first and
    second derivatives, by the implicit function theorem.

    Args: start: where the search begins, without derivative but for the period of a cycle that has a given one;
        least: see `Flow.end`.
    """
    found = stop_gradients(search(shooting, system, *start))
    charts, slope, z = found.charts, found.slope, jnp.where(found.is_last, found.step, 0.0)
    m, free = shooting.segments, int(shooting.is_free)
    period = found.period if shooting.is_free else start[1]

    def parts(z):
        return (z[: z.shape[0] - free].reshape(m, -1), period * jnp.exp(z[-1]) if free else period)

    def once(z, _):
        step = solve_slope(slope, -shooting.rows(system, charts, *parts(z), gradient, least))
        return z + jnp.where(found.is_last, step, 0.0), None

    z = lax.scan(once, z, None, length=2)[0]
    xi, longer = parts(z)
    return Solution(shooting.states(system, charts, xi, longer), longer, found.is_last)


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
    slope: Array
    charts: Chart
    trial_states: State
    trial_period: Array
    is_last: Array


def search(shooting: Shooting, system: System, states: State, period: Array) -> NewtonSearch:
    """Newton's method with a backtracking line search from states (m,) and a period, until its steps are small."""
    shooting, system, states, period = stop_gradients((shooting, system, states, period))
    last_step = _LAST_STEP[period.dtype.itemsize]
    m = shooting.segments

    def moved(charts, period, z):
        free = int(shooting.is_free)
        xi = (z[: z.shape[0] - free] if free else z).reshape(m, -1)
        longer = period * jnp.exp(z[-1]) if free else period
        return shooting.states(system, charts, xi, longer), longer

    def once(s):
        charts = shooting.charts(system, s.trial_states, s.trial_period)
        linear = shooting.linearised(system, charts, s.trial_period)
        loss, J = 0.5 * jnp.sum(linear.rows**2), linear.matrix
        step = solve_slope(J, -linear.rows)
        descent = linear.rows @ (J @ step)
        whole = jnp.ones_like(loss)
        if shooting.is_free:
            whole = jnp.minimum(1.0, _LARGEST_CHANGE / jnp.maximum(jnp.abs(step[-1]), 1e-30))
        nearer = loss <= s.loss + _SUFFICIENT_DECREASE * s.length * s.descent
        small = jnp.max(jnp.abs(step), initial=0.0) <= last_step
        better = (s.trials == 0) | nearer | (small & jnp.isfinite(loss))
        taken = (s.trial_states, s.trial_period, loss, descent, step, whole, J, charts)
        kept = (s.states, s.period, s.loss, s.descent, s.step, 0.5 * s.length, s.slope, s.charts)
        chosen = jax.tree.map(lambda a, b: jnp.where(better, a, b), taken, kept)
        _, period, *_, step, length, _, charts = chosen
        trial = moved(charts, period, length * step)
        return NewtonSearch(s.trials + 1, *chosen, *trial, better & small)

    def goes_on(s):
        usable = jnp.all(jnp.isfinite(s.step)) & (s.length >= _LEAST_LENGTH)
        return ~s.is_last & (s.trials < _MOST_STEPS) & usable

    charts = shooting.charts(system, states, period)
    n, h = m * charts.num_numbers, shooting.held.number
    free, far = int(shooting.is_free), jnp.asarray(jnp.inf, period.dtype)
    none, slope = jnp.zeros(n + free, period.dtype), jnp.zeros((n + h, n + free), period.dtype)
    first = NewtonSearch(
        jnp.zeros((), jnp.int32),
        *(states, period, far, far, none, jnp.ones_like(far), slope, charts, states, period),
        jnp.asarray(False),
    )
    return lax.while_loop(goes_on, once, first)
