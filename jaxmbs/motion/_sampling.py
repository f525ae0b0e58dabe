"""Motions with sampled blocks between saved times: the steps from the saved state before are taken once more."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..assembly._state import State
from ..checks import is_concrete
from ..kinematics._configuration import at_state, with_velocities
from ..math._nan import masked, nan_where
from ..model._changes import with_changes
from ..model._system import System
from ..ode._samples import SampleClock
from ..runtime import as_array
from ..signal_flow._sampling import sample_periods, sampled_values
from ._diagnostics import Diagnostics

#: Samples between two saved times that a trace makes room for, where their number is not known.
_TRACED_SAMPLES = 32


class Sampling(eqx.Module):
    """Options by which a motion with samples was made, so that a part of it can be made again.

    Attributes:
        start: () time of the first sample [s].
        numbers, rest: options of the integration, those that are arrays and the others.
        formulation: of the equations; integrate: from a state, as of `simulate`.
    """

    start: Float[Array, "..."]
    numbers: Any
    rest: Any = eqx.field(static=True)
    formulation: Any = eqx.field(static=True)
    integrate: Callable = eqx.field(static=True)

    @classmethod
    def of(cls, start: Array, options: Any, formulation: Any, integrate: Callable) -> "Sampling":
        """That of a motion from a start on."""
        is_array = lambda x: isinstance(x, jax.Array | np.ndarray | np.generic)
        numbers, rest = eqx.partition(options._replace(progress=False), is_array)
        numbers = jax.tree.map(lambda x: as_array(x, None), numbers)
        return cls(as_array(start), numbers, rest, formulation, integrate)

    def part(self, system: System, state: State, ts: Array, t1: Array) -> Any:
        """The motion from one of its states to a time t1 (), with the states at times ts (n,)."""
        options = eqx.combine(self.numbers, self.rest)
        here = with_changes(system, state)
        return self.integrate(here, state, ts, t1, self.formulation, None, options, self.start)

    def state_at(self, system: System, state: State, t: Array) -> State:
        """The state at a time t () after one of its states, without an event in between; before a sample there."""
        return self.part(system, state, t[None], t).end

    def clock(self, system: System) -> SampleClock:
        """The instants of the samples."""
        return SampleClock(self.start, sample_periods(system))  # type: ignore[arg-type]


def num_samples(sampling: Sampling, system: System, ts: Any) -> int:
    """Bound on the number of samples between two of the times, a power of two; a fixed one inside of traces."""
    periods = sample_periods(system)
    if not is_concrete(sampling.start, periods, ts):
        return _TRACED_SAMPLES
    times = np.asarray(ts)[np.isfinite(np.asarray(ts))]
    longest = np.max(np.diff(times), initial=0.0)
    most = int(np.sum(np.ceil(longest / np.asarray(periods) + 1e-6)))
    return 1 << max(0, most - 1).bit_length()


def after_sample(system: System, state: State, due: Array) -> State:
    """A state after the samples of the periods that are due (m,)."""
    here = with_changes(system, state)
    at = with_velocities(here, at_state(here, state, inertias=False), state.velocities)
    values = sampled_values(here, at, state.internal.values, due)  # type: ignore[union-attr]
    return eqx.tree_at(lambda s: s.internal.values, state, values)


def rows_with_samples(
    sampling: Sampling, system: System, rows: State, accounts: Diagnostics, number: int
) -> tuple[State, Diagnostics]:
    """Rows of a motion (T,) and its accounts with both sides of all samples among them, `number` between two rows.

    Rows without a sample stand twice.  NaN where more samples are between two rows.
    """
    clock = sampling.clock(system)
    last = jnp.sum(jnp.isfinite(rows.t), dtype=jnp.int32) - 1
    index = jnp.arange(len(rows.t), dtype=jnp.int32)
    begins, ends = (jax.tree.map(lambda x, k=k: x[jnp.minimum(index + k, last)], rows) for k in (0, 1))

    def between(row):
        begin, account, then = row
        end, instants = then.t, clock.following(begin.t, number + 1)
        instants = jnp.where(instants < end - clock.tolerance(end), instants, end)
        part = sampling.part(system, begin, instants[:-1], end)
        inside = jax.tree.map(
            lambda a, b, c: jnp.concatenate([a[None], masked(part.states.t >= end, b, c[None])]),
            begin,
            part.states,
            then,
        )
        taken = lambda state: clock.is_sample(state.t) & (state.t < end)
        after = jax.vmap(lambda state: after_sample(system, state, taken(state)))(inside)
        missed = instants[-1] < end
        after = eqx.tree_at(lambda s: s.coordinates, after, nan_where(missed, after.coordinates))
        both = jax.tree.map(lambda a, b: jnp.stack([a, b], axis=1).reshape(2 * len(a), *a.shape[1:]), inside, after)
        return both, _continued(account, _of_times(part.diagnostics))

    found, more = jax.vmap(between)((begins, _of_times(accounts), ends))
    found = eqx.tree_at(lambda s: s.t, found, jnp.where((index > last)[:, None], jnp.inf, found.t))
    found, more = jax.tree.map(lambda x: x.reshape(x.shape[0] * x.shape[1], *x.shape[2:]), (found, more))
    counts = accounts.num_steps, accounts.num_rejected
    return found, eqx.tree_at(lambda d: (d.num_steps, d.num_rejected), more, counts, is_leaf=lambda x: x is None)


def _of_times(accounts):
    """The accounts that belong to times."""
    return eqx.tree_at(lambda d: (d.num_steps, d.num_rejected), accounts, (None, None))


def _continued(account, part):
    """Accounts of a row and of the part of the motion from there on (n,), each of them twice."""
    whole = jax.tree.map(lambda a, b: jnp.concatenate([a[None], b]), account, part)
    since = lambda d: (d.work, d.energy_residual)
    sums = jax.tree.map(lambda a, b: jnp.concatenate([a[None], a[None] + b]), since(account), since(part))
    return jax.tree.map(lambda x: jnp.repeat(x, 2, axis=0), eqx.tree_at(since, whole, sums))
