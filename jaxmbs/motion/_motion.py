"""Result of a simulation: states at the saved times, the status of its end, and its accounts."""

import functools
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..assembly._state import State
from ..assembly._state_report import coordinate_names, shown_coordinates, state_quantities, velocity_names
from ..checks import is_concrete
from ..errors import ModelError
from ..kinematics._poses import node_parameters
from ..math._nan import nan_where
from ..model._entry_points import check_state
from ..model._internal_states import replace_field
from ..model._system import System
from ..reports import Note, Report, Reported
from ..runtime import as_array, jit, not_tracing
from ..status import Status, succeeded
from ..tables import format_number, span
from ..typing import ArrayLike
from ._diagnostics import Diagnostics
from ._event_record import EventRecord
from ._event_sides import merged
from ._interpolation import between, knots_of
from ._sampling import Sampling, num_samples, rows_with_samples


def _table_parts(motion):
    """Every coordinate and internal state in a row; how the motion ended and its accounts in the summary."""
    ts, accounts = np.asarray(motion.ts), motion.diagnostics
    residual, drift = (np.nanmax(np.abs(x)) for x in (accounts.energy_residual, accounts.constraint_drift))
    summary = (
        f"{len(ts)} instants from {format_number(ts[0])} to {format_number(ts[-1])} s, {motion.status}; "
        f"{int(accounts.num_steps)} steps, energy residual {format_number(residual)} J, drift {format_number(drift)}"
    )
    rows = [(name, *span(values), unit or "-") for name, values, unit in shown_coordinates(motion.states)]
    if (internal := motion.states.internal) is not None:
        values = np.asarray(internal.values)
        units = [record.unit or "-" for record in internal.records for _ in record.entries]
        rows += [(n, *span(values[:, k]), units[k]) for k, n in enumerate(internal.entries)]
    return summary, [("coordinate", "first", "last", "least", "largest", "unit"), *rows]


class Motion(Reported, eqx.Module):
    """States at the times `ts` (T,), the result code () and diagnostics; a pytree, so it can be batched.

    `motion[k]` is the k-th saved state, `motion.at(system, t)` one between them; questions take the motion as well.

    `end` is the state that the integrator reached, at its time `end.t` [s]: the end asked for, or that of the event.
    All have derivatives, by times too; the sizes of steps are held.  Of a motion that failed the states saved before
    are kept; those after it are NaN, and so is every result and derivative that follows from them, or derivative that
    follows from its `end`.  Where only the energy account is off all states are kept.

    `events` is the record of the events that acted and of the one that ended the motion; None without events.  Each
    state knows the numbers of the mechanism that events have changed by then, and every question takes them: pass the
    system that the motion was made with.  Saved at the time of an event is the state after it; saved at the time of a
    sample of a block is the state before it, so that a motion may be continued from any of its states.
    `sampling` says how the samples of blocks were taken; None without sampled blocks.  `solver` has the solver and
    its tolerances in words.
    """

    ts: Float[Array, " times"]
    states: State
    result: Int[Array, "..."]
    diagnostics: Diagnostics
    end: State
    events: EventRecord | None = None
    sampling: Sampling | None = None
    solver: Note = eqx.field(static=True, default=Note())

    def report(self) -> Report:
        summary, rows = _table_parts(self)
        fault = "" if self.ok else str(self.status)
        return Report(state_quantities(self.states), summary, fault, self.ts, rows)

    @property
    def status(self) -> Status:
        """Status of the end of the motion, `str` of it in words (concrete motions of one design)."""
        return Status(int(np.asarray(self.result)))

    @property
    def ok(self) -> jax.Array:
        """True if the motion ended as asked (traceable)."""
        return succeeded(self.result)

    def __len__(self) -> int:
        """Number of saved times."""
        return self.ts.shape[-1]

    def __getitem__(self, index: Any) -> State:
        """The saved state of a number, or states of a slice or array of numbers: `motion[-1]`, `motion[10:20]`.

        Of a batch of motions those of every design.  Raises: IndexError.
        """
        if is_concrete(index) and not isinstance(index, slice):
            beyond = np.asarray(index)
            if beyond.dtype.kind not in "iu" or np.any((beyond >= len(self)) | (beyond < -len(self))):
                raise IndexError(f"a motion of {len(self)} saved states has none of number {index!r}")
        designs = (slice(None),) * (self.ts.ndim - 1)
        if not_tracing() and is_concrete(self.states, index):
            rows = np.arange(len(self))[index] if isinstance(index, slice) else np.asarray(index)
            return _rows(self.states, as_array(rows, np.int32), self.ts.ndim - 1)
        return jax.tree.map(lambda x: x[(*designs, index)], self.states)

    def internal(self, name: str) -> jax.Array:
        """An internal state of a force element by name, `motion.internal("boom.p0")`: an array `(T, ...)`.

        Raises: UnknownNameError; ModelError for a motion without internal states.
        """
        if self.states.internal is None:
            raise ModelError([f"no force element of the motion has internal states, so there is no {name!r}"])
        return self.states.internal[name]

    def at(self, system: System, t: ArrayLike) -> State:
        """The state at a time t, or states at times (...,) [s], between the saved ones.

        Quintic polynomials through coordinates, velocities and accelerations of the two saved states around t, with
        all constraints closed again: the error falls with the sixth power of the interval between saved times (half
        that, and more, where a force has a kink in it), 1e-7 of a pendulum's swing at twenty times a period.  Where
        an event acted in between they end on its side; at its time the state is that after it.  With sampled blocks
        the motion is integrated once more from the saved state before, with the options of `simulate`.

        Raises: ValueError for a batch of motions, and for times beyond the saved ones; where those are traced the
        state is NaN.
        """
        check_state(system, self.states)
        if self.ts.ndim != 1:
            raise ValueError(f"one motion has states at a time, use jax.vmap; the times have shape {self.ts.shape}")
        t = as_array(t)
        if is_concrete(t, self.ts):
            saved = np.asarray(self.ts)[np.isfinite(self.ts)]
            if not len(saved) or np.any(~((np.asarray(t) >= saved[0]) & (np.asarray(t) <= saved[-1]))):
                span = f"from {saved[0]:.6g} to {saved[-1]:.6g} s" if len(saved) else "at no time"
                raise ValueError(f"the motion has states saved {span}, not at {t}")
        rows = with_events(self)
        return _at(system, rows.states, rows.ts, self.sampling, t)

    def with_knots(self, system: System) -> "Motion":
        """The motion with the states on both sides of every event that acted, and of every sample, among the saved
        ones: two at the same time.  For plots, powers, stresses and damage through impacts, latches and samples.

        Between two neighbours the motion is smooth.  Without events that act and samples it is the motion itself; in
        traces and batches unused entries are at the end, at infinite times.

        Raises: ModelError for the motion of another system.
        """
        check_state(system, self.states)
        found = pieces_of(system, self)
        return found if found is self else _without_unused(found)

    def to_xarray(self) -> Any:
        """An `xarray.Dataset` over `time`: coordinates and velocities by joint ("pin", or "plate x", "ball w" of one
        with several), internal states of force elements with their units, energies, and the work of every element."""
        import xarray

        psi, u = np.asarray(self.states.coordinates), np.asarray(self.states.velocities)
        kinds = coordinate_names, velocity_names
        names = [of(self.states.structure, x.shape[-1]) for of, x in zip(kinds, (psi, u), strict=True)]
        found, energy = self.diagnostics, {"units": "J"}
        work = np.stack([np.asarray(w) for w in found.work.values()], -1) if found.work else np.zeros((len(psi), 0))
        data = {
            "coordinates": (("time", "coordinate"), psi),
            "velocities": (("time", "velocity"), u),
            "kinetic": ("time", np.asarray(found.kinetic), energy),
            "potential": ("time", np.asarray(found.potential), energy),
            "work": (("time", "element"), work, energy),
        }
        places: dict[str, Any] = {"coordinate": names[0], "velocity": names[1], "element": list(found.work)}
        if (internal := self.states.internal) is not None:
            units = [record.unit for record in internal.records for _ in record.entries]
            data["internal"] = (("time", "internal_state"), np.asarray(internal.values))
            places |= {"internal_state": list(internal.entries), "unit": ("internal_state", units)}
        time = ("time", np.asarray(self.ts), {"units": "s"})
        return xarray.Dataset(data, {"time": time, **places}, {"status": str(self.status)})

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame` by time: coordinates by joint, "velocity of ..." each, internal states of elements
        by name, and energies [J]."""
        import pandas

        found = self.to_xarray()
        parts = [
            found["coordinates"].to_pandas(),
            found["velocities"].to_pandas().add_prefix("velocity of "),
            *([found["internal"].to_pandas()] if "internal" in found else []),
            found[["kinetic", "potential"]].to_dataframe(),
        ]
        return pandas.concat([part.rename_axis(columns=None) for part in parts], axis=1)


def pieces_of(system: System, motion: Motion) -> Motion:
    """The motion with both sides of its events and samples among its states; those that did not come are at the end,
    at infinite times."""
    motion = with_events(motion)
    if motion.sampling is None:
        return motion
    of_one = functools.partial(_with_samples, number=num_samples(motion.sampling, system, motion.ts))
    for _ in range(motion.ts.ndim - 1):
        of_one = jax.vmap(of_one, (None, 0))
    return of_one(system, motion)


def with_events(motion: Any) -> Any:
    """The motion with both sides of its events among its states."""
    if motion.events is None or motion.events.sides is None:
        return motion
    of_one = _with_sides
    for _ in range(motion.ts.ndim - 1):
        of_one = jax.vmap(of_one)
    return of_one(motion)


@jit
def _with_sides(motion):
    states, accounts = merged(motion.events.sides, motion.states, motion.diagnostics)
    return _with_rows(replace_field(motion, "events", replace_field(motion.events, "sides", None)), states, accounts)


@jit(compile="tape")
def _with_samples(system, motion, number):
    states, accounts = rows_with_samples(motion.sampling, system, motion.states, motion.diagnostics, number)
    return _with_rows(replace_field(motion, "sampling", None), states, accounts)


def _with_rows(motion, states, accounts):
    found = replace_field(replace_field(motion, "ts", states.t), "states", states)
    return replace_field(found, "diagnostics", accounts)


def events_shown(motion: Any) -> Any:
    """A motion to be drawn: with both sides of its events among its states; the motion itself where none act."""
    found = with_events(motion)
    return found if found is motion else _without_unused(found)


def _without_unused(motion):
    """Without entries at infinite times and those that are there twice, of one known motion; of others itself."""
    if motion.ts.ndim != 1 or not is_concrete(motion.ts):
        return motion
    times = np.asarray(motion.ts)
    twice = np.append(False, (times[1:] == times[:-1]) & _rows_are_equal(motion.states))
    kept = np.flatnonzero(np.isfinite(times) & ~twice)
    return _with_rows(motion, jax.tree.map(lambda x: x[kept], motion.states), motion.diagnostics.rows(kept))


def _rows_are_equal(states):
    """True (T - 1,) where a state is that before it."""
    same = [np.asarray(x) for x in jax.tree.leaves(states)]
    return np.all([np.all((x[1:] == x[:-1]).reshape(len(x) - 1, -1), axis=1) for x in same], axis=0)


@jit(compile="tape")  # a user asks for some times, once
def _at(system, states, ts, sampling, t):
    P, last = node_parameters(system), jnp.sum(jnp.isfinite(ts), dtype=jnp.int32) - 1

    def one(t):
        k = jnp.clip(jnp.searchsorted(ts, t, side="right").astype(last.dtype) - 1, 0, jnp.maximum(last - 1, 0))
        if sampling is None:
            both = jnp.minimum(jnp.stack([k, k + 1]), last)
            knots = knots_of(system, jax.tree.map(lambda x: x[both], states))
            state = between(system, P, knots.number(0), knots.number(1), t)
        else:
            state = sampling.state_at(system, jax.tree.map(lambda x: x[k], states), t)
        outside = ~((t >= ts[0]) & (t <= ts[last]))
        parts = state.coordinates, state.velocities, state.internal
        psi, u, internal = jax.tree.map(lambda x: nan_where(outside, x), parts)
        return State(t, psi, u, structure=state.structure, internal=internal, changes=state.changes)

    found = jax.vmap(one)(t.reshape(-1))
    return jax.tree.map(lambda x: x.reshape(*t.shape, *x.shape[1:]), found)


@jit(compile="tape")
def _rows(states, index, axis):
    """States of the numbers `index` along an axis of times."""
    return jax.tree.map(lambda x: jnp.take(x, index, axis=axis), states)
