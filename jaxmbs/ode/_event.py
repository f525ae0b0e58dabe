"""Event location: a step that brackets a zero crossing is retried, shorter, until it ends on it.

By the Illinois variant of the false position (Dowell and Jarratt, BIT 11, 1971, 168-174); every trial is a step from
the last state before the zero.
"""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

#: Distance from the zero at which the last step ends, in units of that step; one Newton step from there leaves
#: its square, and of its derivatives so much.
_NEAR = 1e-9
#: Part of the step that a trial stays off its ends, so that both sides of the bracket shrink.
_EDGE = 1e-3
#: Speed of an event's value after an action, of that before, below which the action has stopped it.
_AT_REST = 1e-6
#: Roundings of the time that make a step too short to be halved once more: its middle would be one of its ends.
_SHORTEST_STEP = 8.0


class EventBracket(eqx.Module):
    """Brackets of the zeros of several events: the values (n,) at the last state and, once a step has passed a zero,
    those behind it.

    Attributes:
        value: at the last state before the zero.
        past, beyond: a time after the zero (infinite: none known) and the value there.
        came: side of the bracket that the last trial moved: -1 the time after the zero, 1 the last state, 0 none.
        fired: () number of the event on whose zero the last step ended, -1 for none.
        actions: () number of actions so far.
    """

    value: Array
    past: Array
    beyond: Array
    came: Array
    fired: Array
    actions: Array


def start_bracket(value: Array, actions: Any = 0, fired: Any = -1) -> EventBracket:
    """The brackets before a step from a state with these values (n,)."""
    unknown, zero = jnp.full_like(value, jnp.inf), jnp.zeros_like(value)
    return EventBracket(value, unknown, zero, zero, jnp.asarray(fired, jnp.int32), jnp.asarray(actions, jnp.int32))


def bracket_after_action(
    bracket: EventBracket,
    before: EventBracket,
    speeds: Array,
    values: Array,
    rates: Array,
    directions: tuple[int, ...],
) -> EventBracket:
    """The brackets after an action that left the state with these values (n,) and rates of them along the motion.

    The event that acted starts on its zero.  If it looks one way only and the action has sent it back, or stopped it
    there, it starts from just before the zero: so a state that falls through once more is found at once, and never
    missed.  What crosses with the action itself does not count, but an event whose zero was met at the same time is
    still due.

    Args:
        before: the brackets before the step that ended with the action.
        speeds: the rates before the action.
    """
    index, sides = jnp.arange(len(directions), dtype=jnp.int32), jnp.asarray(directions, values.dtype)
    due = _has_crossed(before.value, bracket.value, sides)
    least = -sides * jnp.sqrt(jnp.finfo(values.dtype).tiny)  # not the least number: false position halves it
    start = jnp.where(rates * sides > _AT_REST * jnp.abs(speeds), 0.0, least)
    values = jnp.where(index == bracket.fired, start, jnp.where(due, before.value, values))
    return start_bracket(values, bracket.actions + 1, bracket.fired)


def locate_event(
    bracket: EventBracket, t: Array, t1: Array, value: Array, keep: Array, directions: tuple[int, ...]
) -> tuple[Array, Array, Array, EventBracket]:
    """Judge a step from t to t1 that ends with values (n,) of the events: is it kept, where ends the next?

    A start on the zero itself is no crossing.  A step that ends where a value is not a number is halved, as the
    zero may be before; where that does not help it ends the motion.  Of zeros at the same time the first event's
    counts.

    Args: directions: +1 for an event that looks at rising values alone, -1 at falling ones, 0 at both.

    Returns: True if the step is kept; if it ends the motion where a value is not a number; the latest end of the next
        step; the next brackets, with the event on whose zero the step ended.
    """
    tiny = t1 - t <= _SHORTEST_STEP * jnp.spacing(t1)
    unknown = keep & jnp.isnan(value)
    lost = unknown & (jnp.isnan(bracket.value) | tiny)
    crosses = keep & _has_crossed(bracket.value, value, jnp.asarray(directions, value.dtype))
    miss = jnp.abs(value) * (t1 - t) / jnp.maximum(jnp.abs(value - bracket.value), jnp.finfo(value.dtype).tiny)
    near = (miss <= _NEAR * (t1 - t)) | tiny
    shorter = jnp.any(unknown & ~lost)
    refused = jnp.any(crosses & ~near) | shorter
    again, moves, found = crosses & refused, keep & ~crosses & ~refused, crosses & ~refused
    fired = jnp.where(jnp.any(found), jnp.argmax(found).astype(jnp.int32), -1)

    # a zero behind a step that was refused may not be there for the next, of other length: rounding of a grazing
    known = jnp.isfinite(bracket.past) & ~(moves & (t1 >= bracket.past))
    past = jnp.where(known, bracket.past, jnp.inf)
    before = jnp.where(again & (bracket.came < 0), 0.5, 1.0) * bracket.value  # Illinois: weaken the side that stays
    beyond = jnp.where(moves & (bracket.came > 0), 0.5, 1.0) * bracket.beyond
    trial = _false_position(t, before, t1, value)
    onward = jnp.where(known, _false_position(t1, value, past, beyond), jnp.inf)
    aim = jnp.min(jnp.where(again, trial, jnp.where(moves, onward, past)))
    aim = jnp.where(shorter, jnp.minimum(aim, 0.5 * (t + t1)), aim)
    after = EventBracket(
        value=jnp.where(moves | found, value, before),
        past=jnp.where(again, t1, past),
        beyond=jnp.where(again, value, beyond),
        came=jnp.where(again, -1.0, jnp.where(moves & known, 1.0, bracket.came)),
        fired=fired,
        actions=bracket.actions,
    )
    return keep & ~refused, jnp.any(lost), aim, after


def _has_crossed(before, value, directions):
    """True (n,) where a value has passed zero in the direction of the event, by signs: products would underflow."""
    side = jnp.sign(before)
    return (side != 0.0) & (side * jnp.sign(value) <= 0.0) & (side * directions <= 0.0)


def _false_position(a, value_a, b, value_b):
    """The times at which lines through both values pass zero, off both ends."""
    span = jnp.where(jnp.isfinite(b), b - a, 0.0)
    share = value_a / jnp.where(value_a == value_b, 1.0, value_a - value_b)
    return a + span * jnp.clip(share, _EDGE, 1.0 - _EDGE)
