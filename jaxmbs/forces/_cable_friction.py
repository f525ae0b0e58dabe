"""Capstan friction of a cable: slip over its elements, and the ratios of the tensions of its spans."""

import jax.numpy as jnp
from jax import Array, lax

#: Halvings of the interval that holds the speed of a belt, and steps of Newton after them.  Two that are
#: differentiated make derivatives up to the third exact.
_HALVINGS, _DIFFERENTIATED = 60, 2


def tension_ratios(grip, share, parting, paid, slip_speed, is_closed) -> Array:
    """Tensions (m,) of the spans over that of the first.

    The strain changes alike along the cable, so it slips over element k at the speed w_k towards the next one with
    `w_(k+1) = w_k - parting_k + share_k (sum of parting - paid)`; tensions grow along the slip.

    Args:
        grip: (n,) friction times wrap at each element.
        share: (m,) of each span of the length, sum 1.
        parting: (m,) speeds at which the material points of contact at its ends part [m/s].
        paid: speed at which cable enters at the first element [m/s].
        is_closed: True for a belt, whose speed follows from the ratios once around.
    """
    strain = share * (jnp.sum(parting) - paid) - parting
    slip = paid + jnp.concatenate([jnp.zeros(1, strain.dtype), jnp.cumsum(strain)])[: grip.size]
    if is_closed:
        slip = slip + _speed_of_belt(grip, slip, slip_speed)
        step = grip * jnp.tanh(slip / slip_speed)
        return jnp.exp(jnp.cumsum(step.at[0].set(0.0)))
    step = grip * jnp.tanh(slip / slip_speed)
    return jnp.exp(jnp.cumsum(step.at[0].set(0.0))[: share.size])


def _speed_of_belt(grip, slip, slip_speed):
    """Speed w that makes `sum of grip tanh((slip + w) / slip_speed)` zero, so that tensions agree once around."""
    held_grip, held_slip, held_speed = lax.stop_gradient((grip, slip, slip_speed))
    low, high = -jnp.max(held_slip), -jnp.min(held_slip)

    def halve(_, interval):
        low, high = interval
        middle = (low + high) / 2
        rises = jnp.sum(held_grip * jnp.tanh((held_slip + middle) / held_speed)) < 0
        return jnp.where(rises, middle, low), jnp.where(rises, high, middle)

    low, high = lax.fori_loop(0, _HALVINGS, halve, (low, high))
    w = lax.stop_gradient((low + high) / 2)
    for _ in range(_DIFFERENTIATED):
        y = jnp.tanh((slip + w) / slip_speed)
        slope = jnp.sum(grip * (1 - y**2)) / slip_speed
        w = w - jnp.where(slope > 0, jnp.sum(grip * y) / jnp.where(slope > 0, slope, 1.0), 0.0)
    return w
