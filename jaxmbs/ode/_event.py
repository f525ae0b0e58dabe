"""Event location: a step that brackets a zero crossing is retried, shorter, until it ends on it.

By the Illinois variant of the false position (Dowell and Jarratt, BIT 11, 1971, 168-174); every trial is a step from
the last state before the zero.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

#: Distance from the zero at which the last step ends, in units of that step; one Newton step from there leaves
#: its square, and of its derivatives so much.
_NEAR = 1e-9
#: Part of the step that a trial stays off its ends, so that both sides of the bracket shrink.
_EDGE = 1e-3
#: Roundings of the time that make a step too short to be halved once more: its middle would be one of its ends.
_SHORTEST_STEP = 8.0


class EventBracket(eqx.Module):
    """A bracket of the zero: the event's value () at the last state and, once a step has passed the zero, behind it.

    Attributes:
        value: at the last state before the zero.
        past, beyond: a time after the zero (infinite: none known) and the value there.
        came: side of the bracket that the last trial moved: -1 the time after the zero, 1 the last state, 0 none.
    """

    value: Array
    past: Array
    beyond: Array
    came: Array


def start_bracket(value: Array) -> EventBracket:
    """The bracket before the first step, from a state with this value ()."""
    return EventBracket(value, jnp.full_like(value, jnp.inf), jnp.zeros_like(value), jnp.zeros_like(value))


def locate_event(
    bracket: EventBracket, t: Array, t1: Array, value: Array, keep: Array
) -> tuple[Array, Array, Array, Array, EventBracket]:
    """Judge a step from t to t1 that ends with a value of the event: is it kept, is it the last, where ends the next?

    A start on the zero itself is no crossing.  A step that ends where the function is not a number is halved, as the
    zero may be before; where that does not help it ends the motion.

    Returns: True if the step is kept; if it ends on the zero; if it ends the motion where the value is not a number;
        the latest end of the next step; the next bracket.
    """
    tiny = t1 - t <= _SHORTEST_STEP * jnp.spacing(t1)
    unknown = keep & jnp.isnan(value)
    lost = unknown & (jnp.isnan(bracket.value) | tiny)
    crosses = keep & (value * bracket.value <= 0.0) & (bracket.value != 0.0)
    miss = jnp.abs(value) * (t1 - t) / jnp.maximum(jnp.abs(value - bracket.value), jnp.finfo(value.dtype).tiny)
    found = crosses & ((miss <= _NEAR * (t1 - t)) | tiny)
    shorter = unknown & ~lost
    again, moves = crosses & ~found, keep & ~crosses & ~shorter

    known = jnp.isfinite(bracket.past)
    before = jnp.where(again & (bracket.came < 0), 0.5, 1.0) * bracket.value  # Illinois: weaken the side that stays
    beyond = jnp.where(moves & (bracket.came > 0), 0.5, 1.0) * bracket.beyond
    trial = _false_position(t, before, t1, value)
    onward = jnp.where(known, _false_position(t1, value, bracket.past, beyond), jnp.inf)
    aim = jnp.where(again, trial, jnp.where(moves, onward, bracket.past))
    aim = jnp.where(shorter, 0.5 * (t + t1), aim)
    after = EventBracket(
        value=jnp.where(moves, value, before),
        past=jnp.where(again, t1, bracket.past),
        beyond=jnp.where(again, value, beyond),
        came=jnp.where(again, -1.0, jnp.where(moves & known, 1.0, bracket.came)),
    )
    return keep & ~again & ~shorter, found, lost, aim, after


def _false_position(a, value_a, b, value_b):
    """The time at which a line through both values passes zero, off both ends."""
    span = jnp.where(jnp.isfinite(b), b - a, 0.0)
    share = value_a / jnp.where(value_a == value_b, 1.0, value_a - value_b)
    return a + span * jnp.clip(share, _EDGE, 1.0 - _EDGE)
