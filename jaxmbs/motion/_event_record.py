"""Record of the events of a motion."""

from typing import TYPE_CHECKING, Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float, Int

from ..assembly._state import State
from ..quantities import Axis, Quantity
from ..reports import Report, Reported
from ..tables import format_number
from ._diagnostics import Diagnostics

if TYPE_CHECKING:
    from ..ode._problem import LoopState


def _table_parts(record):
    times, numbers = np.asarray(record.times), np.asarray(record.numbers)
    rows = [(record.names[k], format_number(t)) for t, k in zip(times, numbers, strict=True) if k >= 0]
    return f"{len(rows)} events", [("event", "time [s]"), *rows]


class EventSides(eqx.Module):
    """Both sides of the events that acted: for each of them before its action, then after it.

    Attributes:
        states: (2 n,), each with the numbers of the mechanism on its side; NaN for events that did not come.
        accounts: energies and work there (2 n,).
        places: (n,) number of saved times before each event.
    """

    states: State
    accounts: Diagnostics
    places: Int[Array, "..."]


class EventRecord(Reported, eqx.Module):
    """The events that acted, in their order, and after them the one that ended the motion.

    Attributes:
        times: (n,) [s], with derivatives; infinite for those that did not come.
        numbers: (n,) of the events, in the order in which they were given; -1 for those that did not come.
        names: of the events.
        sides: of those that may act, None where none does.
    """

    times: Float[Array, "..."]
    numbers: Int[Array, "..."]
    names: tuple[str, ...] = eqx.field(static=True)
    sides: EventSides | None = None

    def report(self) -> Report:
        summary, rows = _table_parts(self)
        known = np.asarray(self.numbers) >= 0
        times, numbers = (np.asarray(x)[known] for x in (self.times, self.numbers))
        axis = (Axis("event", np.arange(len(times))),)
        found = [Quantity("time", times, "s", axis), Quantity("number", numbers, "", axis)]
        return Report(found, summary, table=rows)

    @property
    def before(self) -> State | None:
        """States (n,) just before the events that may act, NaN for those that did not come; None where none may."""
        return None if self.sides is None else _every_second(self.sides.states, 0)

    @property
    def after(self) -> State | None:
        """States (n,) just after those events, as their actions leave them."""
        return None if self.sides is None else _every_second(self.sides.states, 1)

    @property
    def count(self) -> Array:
        """Number () of events."""
        return jnp.sum(self.numbers >= 0, axis=-1)

    def named(self) -> list[str]:
        """Names of the events that came, in their order (concrete motions of one design)."""
        return [self.names[k] for k in np.asarray(self.numbers) if k >= 0]


def _every_second(states, first):
    """Every second state of the last leading axis."""
    designs = (slice(None),) * (states.t.ndim - 1)
    return jax.tree.map(lambda x: x[(*designs, slice(first, None, 2))], states)


def event_record(
    names: tuple[str, ...], account: Any, final: "LoopState", reached: Array, ended: Array, sides: EventSides | None
) -> EventRecord:
    """The record from the account of the actions, None where none act, and the event at the end, if one `ended` the
    motion there."""
    empty = jnp.zeros(0, reached.dtype)
    times, numbers = (empty, empty) if account is None else (account.times, account.numbers)
    index = jnp.arange(len(times) + 1, dtype=jnp.int32)
    numbers = jnp.concatenate([jnp.round(numbers).astype(jnp.int32), jnp.zeros(1, jnp.int32)]) - 1
    count = jnp.sum(numbers >= 0, dtype=jnp.int32)
    last = (index == count) & ended
    fired = final.bracket.fired if final.bracket is not None else -1
    numbers = jnp.where(last, fired, numbers)
    times = jnp.where(last, reached, jnp.concatenate([times, jnp.zeros_like(times, shape=1)]))
    return EventRecord(jnp.where(numbers >= 0, times, jnp.inf), numbers, names, sides)
