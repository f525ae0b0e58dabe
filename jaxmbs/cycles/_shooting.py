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
from ..math import _square as square
from ..model._system import System
from ..runtime import jit, lapack
from ._chart import Chart, rate_of_numbers, rates_seen, value_and_slope
from ._flow import Flow

_LARGEST_CHANGE = 0.3  # of the period in one step, of its logarithm
#: Least singular value of the slope: a smaller one is none.
SINGULAR = {8: 1e-7, 4: 1e-3}
_NO_SLOPE = {8: 3e-8, 4: 1e-4}  # of the largest singular value: below is none, but for errors of the motions


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

    def parts(self, z: Array, period: Array) -> tuple[Array, Array]:
        """Numbers (m, n) of the charts and the period of unknowns z (m n + 0 or 1,), around a period."""
        number = z.shape[0] - int(self.is_free)
        return z[:number].reshape(self.segments, -1), period * jnp.exp(z[-1]) if self.is_free else period

    def displaced_states(self, system: System, charts: Chart, period: Array, z: Array) -> tuple[State, Array]:
        """States (m,) and the period of unknowns z around charts (m,) and a period."""
        xi, longer = self.parts(z, period)
        return self.states(system, charts, xi, longer), longer

    def size(self, system: System, charts: Chart) -> Array:
        """Size () of the motion through the states of charts (m,), by its rates there [m, rad]."""
        rates = jax.vmap(lambda chart: rate_of_numbers(system, chart) / chart.rate)(charts)
        return jnp.max(jnp.abs(rates), initial=0.0)

    def longest_step(self, number: int) -> Array:
        """Largest step (number,) of the unknowns: that of the logarithm of the period is bounded."""
        longest = jnp.full(number, jnp.inf, self.t0.dtype)
        return longest.at[-1].set(_LARGEST_CHANGE) if self.is_free else longest

    def rows(
        self, system: System, charts: Chart, xi: Array, period: Array, gradient: str, least: Array | int | None = None
    ) -> Array:
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

    def linearised(self, system: System, charts: Chart, period: Array, least: Array | int | None = None) -> "Linear":
        """Rows and their slopes at the charts' states.  Args: least: see `Flow.end`."""
        times, gains = self.times(period), self._gains

        def segment(one):
            chart, following, t0, t1, gain = one
            f, G, end = end_slope(self.flow, system, (chart, following), (t0, t1), gain, self.winds, least)
            g, H = begin_slope(system, following, following.state.t, self.is_free)
            return f - g, G, H, rates_seen(system, following, end) if self.is_free else f[:0]

        after = _following(charts)
        gaps, G, H, faster = lax.map(segment, (charts, after, times[:-1], times[1:], gains))
        n = charts.num_numbers
        by_period = jnp.zeros((self.segments, n, 0), G.dtype)
        if self.is_free:
            by_period = self._by_period(system, charts, times, (G, H, faster))[..., None]
        first, zero = jax.tree.map(lambda x: x[0], charts), jnp.zeros(n, G.dtype)
        of_start = lambda xi: self._others(system, first, first.state_at(system, xi, self.t0), xi)
        others, E = value_and_slope(of_start, zero)
        E = jnp.concatenate([E, jnp.zeros((E.shape[0], int(self.is_free)), E.dtype)], axis=1)
        return Linear(jnp.concatenate([gaps.reshape(-1), others]), G, H[..., :n], by_period, E)

    def _by_period(self, system, charts, times, slopes):
        """Slopes (m, n) of the gaps by the logarithm of the period.

        A motion that begins later is the one that begins at its state of that time: no motion beside the segments'
        own ones is needed.
        """
        G, H, faster = slopes
        n, late = charts.num_numbers, times - self.t0
        before = jnp.roll(H, 1, axis=0)  # of a segment's own begin: by its numbers, and by its time
        along = jax.vmap(lambda chart: rate_of_numbers(system, chart))(charts)
        shift = jax.vmap(square.solve)(before[..., :n], before[..., n] - along)
        by_begin = jnp.einsum("kij,kj->ki", G, shift) * late[:-1, None]
        begins = jnp.roll(late[:-1], -1)[:, None]  # the last segment is followed by the first
        return by_begin + faster * late[1:, None] - H[..., n] * begins


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
    least: Array | int | None = None,
) -> tuple[Array, Array, State]:
    """Numbers (n,) in a second chart of the end of the motion from a first one's state, their slopes (n, n), the end.

    Args: least: see `Flow.end`.
    """
    chart, following = charts
    t0, t1 = times

    def reached(z):
        end = flow.end(system, chart.state_at(system, z, t0), t1, least=least)
        return following.numbers_of(system, end, gain, winds), end

    z = jnp.zeros(chart.num_numbers, gain.dtype)
    if not z.shape[0]:
        value, end = reached(z)
        return value, jnp.zeros((0, 0), gain.dtype), end
    along = lambda direction: jax.jvp(reached, (z,), (direction,), has_aux=True)
    return jax.vmap(along, out_axes=(None, 1, None))(jnp.eye(z.shape[0], dtype=z.dtype))


@jit
def begin_slope(system: System, chart: Chart, t: Array, by_time: bool) -> tuple[Array, Array]:
    """Numbers (n,) of a chart's own states, and their slopes (n, n).  Args: by_time: one column more, by the time."""
    n, none = chart.num_numbers, jnp.zeros_like(chart.state.velocities)

    def own(z):
        state = chart.state_at(system, z[:n], t + z[n] if by_time else t)
        return chart.numbers_of(system, state, none, jnp.zeros(none.shape, bool))

    return value_and_slope(own, jnp.zeros(n + int(by_time), none.dtype))


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

    @property
    def decomposition(self) -> "Decomposition":
        """Singular values of the slope, without derivative; that by a period in units of its own length."""
        J, free = lax.stop_gradient(self.matrix), self.by_period.shape[-1]
        lengths = jnp.sqrt(jnp.sum(J[:, J.shape[1] - free :] ** 2, axis=0))  # as large as the motion
        units = jnp.ones(J.shape[1], J.dtype).at[J.shape[1] - free :].set(jnp.where(lengths > 0.0, lengths, 1.0))
        U, values, Vh = lapack.svd(J / units[None, :])
        return Decomposition(U, values, Vh, units)

    @property
    def is_singular(self) -> Array:
        """True () where some small deviation comes back to itself: the cycle is one of many, or at a fold."""
        return self.decomposition.least < SINGULAR[self.rows.dtype.itemsize]


class Decomposition(NamedTuple):
    """`U diag(values) Vh` of a slope over units (n,) of the unknowns, of which there may be more rows."""

    U: Array
    values: Array
    Vh: Array
    units: Array

    @property
    def least(self) -> Array:
        """The least singular value (); infinite where nothing is unknown."""
        return self.values[-1] if self.values.shape[0] else jnp.asarray(jnp.inf, self.values.dtype)

    @property
    def direction(self) -> Array:
        """The change (n,) of the unknowns that changes the rows least."""
        return self.Vh[-1] / self.units if self.values.shape[0] else self.units

    @property
    def inverse(self) -> Array:
        """The inverse (n, rows); directions in which the slope is singular are left out."""
        used = self.values > _NO_SLOPE[self.values.dtype.itemsize] * jnp.max(self.values, initial=0.0)
        shares = jnp.where(used, 1.0 / jnp.where(used, self.values, 1.0), 0.0)
        return (self.Vh.T / self.units[:, None]) @ (shares[:, None] * self.U.T)
