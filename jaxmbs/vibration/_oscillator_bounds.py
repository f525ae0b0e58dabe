"""Bounds of the motions of oscillators within steps over which their load is straight."""

from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from ._oscillator_motion import Oscillators


class BoundFactors(NamedTuple):
    """Factors of the bounds by states, loads and their rises in a step, each (f,).

    Attributes:
        rest: position at rest by the load and by its rise.
        speed: of the free motion about it over its circular frequency, by v / scale, the load and its rise.
        has_envelope: a spring holds the oscillator, and damping takes energy from it.
        phase: radians of an undamped oscillator in a step, 0 without envelope.
        beyond: excess of a motion in a step over its ends, by its size there and those of load and rise.
    """

    rest: tuple[Array, Array]
    speed: tuple[Array, Array, Array]
    has_envelope: Array
    phase: Array
    beyond: tuple[Array, Array, Array]


def bound_factors(scale: Array, step: Array, oscillators: Oscillators) -> BoundFactors:
    """Factors of the bounds in steps of one length.

    A motion is at most `step^2 / 8` times the size of its second derivative q above the line through both ends; the
    equation gives q by the load, the motion and its rate, which is at most the slope of the line and `q step / 2`.
    """
    square, rate, gain, gain_of_slope = oscillators
    has_envelope = (square > 0) & (rate >= 0)
    stiffness = jnp.where(has_envelope, square, 1.0)
    omega, static = jnp.sqrt(stiffness), gain / stiffness
    rest = static, (gain_of_slope - rate * static) / (stiffness * step)
    damping, spring = rate * step, square * step**2
    share = 1 - spring / 8 - damping / 2
    of_size, of_load, of_rise = (
        jnp.where(share > 0, x / jnp.where(share > 0, share, 1.0), jnp.inf)
        for x in (spring / 8 + damping / 4, jnp.abs(gain) * step**2 / 8, jnp.abs(gain_of_slope) * step / 8)
    )
    return BoundFactors(
        rest,
        (scale / omega, gain_of_slope / omega, static / (step * omega)),
        has_envelope,
        jnp.where(has_envelope, omega * step, 0.0),
        (of_size, of_load, of_rise),
    )


def free_state(
    state: Sequence[Array], load: Array, rise: Array, rest: Sequence[Array], speed: Sequence[Array]
) -> tuple[Array, Array]:
    """Free motion (p, q) of a state (y, v / scale) about the moving position at rest, and its rate over omega.

    Damping takes from its energy: within a step it stays within the amplitude `hypot(p, q)` of the beginning.

    Args: rest and speed of `BoundFactors`.
    """
    free = state[0] - (rest[0] * load + rest[1] * rise)
    return free, speed[0] * state[1] + speed[1] * load - speed[2] * rise


def motion_state(
    free: Sequence[Array], load: Array, rise: Array, rest: Sequence[Array], speed: Sequence[Array]
) -> tuple[Array, Array]:
    """State (y, v / scale) of a free motion (p, q): the inverse of `free_state`."""
    y = free[0] + rest[0] * load + rest[1] * rise
    return y, (free[1] - speed[1] * load + speed[2] * rise) / speed[0]


def free_turn(whole: Array, speed: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Matrix of a free motion (p, q) over a step of a transition (2, 4, f)."""
    return (whole[0, 0], whole[0, 1] / speed), (speed * whole[1, 0], whole[1, 1])


def overshoot(factors: BoundFactors, size: Array, load: Array, rise: Array) -> Array:
    """Excess of motions (n, f) in a step over its ends, at most, by the largest sizes there, of load and of rise."""
    of_size, of_load, of_rise = (x[None] for x in factors.beyond)
    found = of_size * size + of_load * load + of_rise * rise
    return jnp.where(jnp.isnan(found), jnp.inf, found)  # infinite factors of nothing
