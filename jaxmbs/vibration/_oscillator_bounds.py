"""Bounds of the motions of oscillators within steps over which their load is straight."""

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
        beyond: excess of a motion in a step over its ends, by its size there and those of load and rise.
    """

    rest: tuple[Array, Array]
    speed: tuple[Array, Array, Array]
    has_envelope: Array
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
        (of_size, of_load, of_rise),
    )


def envelope(
    y: Array, v: Array, load: Array, rise: Array, rest: tuple[Array, Array], speed: tuple[Array, Array, Array]
) -> tuple[Array, Array]:
    """The highest and lowest place that the free motion about the moving position at rest may reach in a step.

    Damping takes from its energy: its amplitude is at most that of the beginning.

    Args: y and v / scale at the beginning, `rest` and `speed` of `BoundFactors`.
    """
    middle, climb = rest[0] * load + rest[1] * rise, rest[0] * rise
    free, rate = y - middle, speed[0] * v + speed[1] * load - speed[2] * rise
    size = jnp.sqrt(free * free + rate * rate)
    return middle + size + jnp.maximum(climb, 0.0), middle - size + jnp.minimum(climb, 0.0)


def overshoot(factors: BoundFactors, size: Array, load: Array, rise: Array) -> Array:
    """Excess of motions (n, f) in a step over its ends, at most, by the largest sizes there, of load and of rise."""
    of_size, of_load, of_rise = (x[None] for x in factors.beyond)
    found = of_size * size + of_load * load + of_rise * rise
    return jnp.where(jnp.isnan(found), jnp.inf, found)  # infinite factors of nothing
