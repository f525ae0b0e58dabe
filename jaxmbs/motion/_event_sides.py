"""Both sides of the events that acted, as rows beside the saved ones; and the motion with them among its states.

Between two neighbours of these rows a motion is smooth.  The two sides of an event have the same time; at a saved
time at which an event acts the state is that after it.
"""

from typing import TYPE_CHECKING, Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array, lax

from ..assembly._state import State
from ..math._nan import masked
from ..runtime import map_chunked
from ._diagnostics import Diagnostics
from ._event_record import EventSides

if TYPE_CHECKING:
    from ..ode._problem import LoopState


def num_actions(numbers: Array) -> Array:
    """Number (...) of actions in an account's numbers of events (..., n)."""
    return jnp.sum(numbers > 0.5, axis=-1, dtype=jnp.int32)


def with_rows_after_events(final: "LoopState", ts: Array, count: Array) -> "LoopState":
    """The loop's final state with the row after the event, the last of several, at saved times (T,) that are its."""
    jumps: Any = final.jumps
    index = jnp.arange(len(jumps.times), dtype=jnp.int32)
    same = (lax.stop_gradient(ts)[:, None] == jumps.times[None, :]) & (index < count)[None, :]
    last, hit = jnp.max(jnp.where(same, index, -1), axis=1), jnp.any(same, axis=1)
    ys = jax.tree.map(lambda x, after: masked(hit, x, after[jnp.maximum(last, 0)]), final.ys, jumps.after)
    return eqx.tree_at(lambda s: s.ys, final, ys)


def rows_of_sides(equations: Any, final: "LoopState", account: Any, end: tuple) -> tuple[tuple, Array]:
    """Rows (time, y) of both sides of every event in turn (2 n, ...), those that did not come as the `end`, and True
    (n,) for events that came.

    They are those of the loop beside the zero, moved onto it along the motion on their side, with its derivative.
    """
    jumps: Any = final.jumps
    used = jnp.arange(len(jumps.times), dtype=jnp.int32) < num_actions(account.numbers)
    both = lambda a, b: jnp.stack([a, b], axis=1).reshape(2 * len(a), *a.shape[1:])
    t, y = both(jumps.times, jumps.times), jax.tree.map(both, jumps.before, jumps.after)
    times, came = both(account.times, account.times), both(used, used)
    reached, *there = end
    t, times = masked(~came, t, lax.stop_gradient(reached)), masked(~came, times, reached)
    y = jax.tree.map(lambda x, x1: masked(~came, x, x1[None]), y, tuple(there))
    rates = map_chunked(lambda row: equations.rate(*row), (t, y))
    late = times - t
    y = jax.tree.map(lambda x, r: x + late.reshape(-1, *[1] * (x.ndim - 1)) * r, y, rates)
    return (times, *y), used


def sides_of(states: State, accounts: Diagnostics, used: Array, actions: Array) -> EventSides:
    """The record of both sides.

    Args:
        states, accounts: of the rows (2 n,).
        used: (n,) events that came; actions: (T,) number of them before each saved time, more than n beyond the end.
    """
    gone = ~jnp.repeat(used, 2)
    states, accounts = jax.tree.map(
        lambda x: masked(gone, x, jnp.nan) if x.ndim and jnp.issubdtype(x.dtype, jnp.floating) else x,
        (states, accounts),
    )
    states = eqx.tree_at(lambda s: s.t, states, masked(gone, states.t, jnp.inf))
    index = jnp.arange(len(used), dtype=actions.dtype)
    places = jnp.sum(actions[None, :] <= index[:, None], axis=1, dtype=jnp.int32)
    return EventSides(states, accounts, jnp.where(used, places, len(actions)))


def merged(sides: EventSides, states: State, accounts: Diagnostics) -> tuple[State, Diagnostics]:
    """Saved states (T,) and accounts with both sides of the events among them (T + 2 n,), in the order of the motion.

    Events that did not come, or came before the first saved time, are at the end, at infinite times.
    """
    number, size = len(sides.places), len(states.t)
    early = (sides.places == 0) & ~(sides.states.t[::2] >= states.t[0])
    places = jnp.where(early, size, sides.places)
    order = jnp.argsort(places, stable=True)  # those before the first saved time go last
    events, saved = jnp.arange(number, dtype=places.dtype), jnp.arange(size, dtype=places.dtype)
    place_of_event = jnp.zeros_like(places).at[order].set(places[order] + 2 * events)
    before = jnp.sum(places[None, :] <= saved[:, None], axis=1, dtype=places.dtype)
    place = jnp.concatenate([saved + 2 * before, jnp.stack([place_of_event, place_of_event + 1], axis=1).reshape(-1)])
    source = jnp.argsort(place)

    def together(a, b):
        return jnp.concatenate([a, b])[source] if a.ndim else a

    times = masked(jnp.repeat(early, 2), sides.states.t, jnp.inf)
    found = eqx.tree_at(lambda s: s.t, sides.states, times)
    return jax.tree.map(together, (states, accounts), (found, sides.accounts))
