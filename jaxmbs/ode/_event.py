"""The zero of a function along a motion: the step that passes it is made again, shorter, until it ends there.

By the Illinois variant of the false position; every trial is a step from the last state before the zero.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

#: How near to the zero the last step ends, in units of that step; one Newton step from there leaves
#: its square, and of its derivatives so much.
_NEAR = 1e-9
_EDGE = 1e-3  # of the step, that a trial stays off its ends


class EventBracket(eqx.Module):
    """Values of the function () at the last state and, once a step has passed the zero, behind it.

    Attributes:
        past, beyond: a time after the zero (infinite: none known) and the value there.
        came: which side the last trial moved: -1 the time after the zero, 1 the state before it, 0 none.
    """

    value: Array
    past: Array
    beyond: Array
    came: Array


def begun(value) -> EventBracket:
    """Before the first step, from a state with this value ()."""
    return EventBracket(value, jnp.full_like(value, jnp.inf), jnp.zeros_like(value), jnp.zeros_like(value))


def locate_event(hunt: EventBracket, t, t1, value, keep):
    """(whether a step from t to t1 stays, ends on the zero, ends where the value is not a number; the latest end of
    the next step; the hunt).

    A start on the zero itself is no crossing.  A step that ends where the function is not a number is halved, as the
    zero may be before; where that does not help it is the end.
    """
    tiny = t1 - t <= 8.0 * jnp.spacing(t1)
    unknown = keep & jnp.isnan(value)
    lost = unknown & (jnp.isnan(hunt.value) | tiny)
    crosses = keep & (value * hunt.value <= 0.0) & (hunt.value != 0.0)
    miss = jnp.abs(value) * (t1 - t) / jnp.maximum(jnp.abs(value - hunt.value), jnp.finfo(value.dtype).tiny)
    found = crosses & ((miss <= _NEAR * (t1 - t)) | tiny)
    shorter = unknown & ~lost
    again, moves = crosses & ~found, keep & ~crosses & ~shorter

    known = jnp.isfinite(hunt.past)
    before = jnp.where(again & (hunt.came < 0), 0.5, 1.0) * hunt.value  # Illinois: weaken the side that stays
    beyond = jnp.where(moves & (hunt.came > 0), 0.5, 1.0) * hunt.beyond
    trial = _between(t, before, t1, value)
    onward = jnp.where(known, _between(t1, value, hunt.past, beyond), jnp.inf)
    aim = jnp.where(again, trial, jnp.where(moves, onward, hunt.past))
    aim = jnp.where(shorter, 0.5 * (t + t1), aim)
    after = EventBracket(
        value=jnp.where(moves, value, before),
        past=jnp.where(again, t1, hunt.past),
        beyond=jnp.where(again, value, beyond),
        came=jnp.where(again, -1.0, jnp.where(moves & known, 1.0, hunt.came)),
    )
    return keep & ~again & ~shorter, found, lost, aim, after


def _between(a, value_a, b, value_b):
    """Where a line through both values passes zero, off both ends."""
    span = jnp.where(jnp.isfinite(b), b - a, 0.0)
    share = value_a / jnp.where(value_a == value_b, 1.0, value_a - value_b)
    return a + span * jnp.clip(share, _EDGE, 1.0 - _EDGE)
