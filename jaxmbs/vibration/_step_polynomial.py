"""Extremes of an oscillator within a short step over which its load is straight."""

import jax.numpy as jnp
from jax import Array

from ._oscillator_motion import Oscillators

REACH = 0.8  # rad in a step, up to which the polynomial has the motion to 2e-8
#: Higher coefficients by what the lower ones leave of the value and three derivatives at the end.
_HIGHER = ((35, -15, 2.5, -1 / 6), (-84, 39, -7, 0.5), (70, -34, 6.5, -0.5), (-20, 10, -2, 1 / 6))


def step_polynomial(
    first: tuple[Array, Array],
    last: tuple[Array, Array],
    load: Array,
    rise: Array,
    step: Array,
    oscillators: Oscillators,
) -> list[Array]:
    """Coefficients of the motion by the part of a step, from values and rates times the step at both ends.

    Those of degree 7 that have the second and third derivatives of the equation at both ends too.
    """
    damping, spring = oscillators.rate * step, oscillators.square * step**2
    gain, kick = oscillators.gain * step**2, oscillators.gain_of_slope * step

    def bends(y, p, load):
        second = gain * load + kick * rise - damping * p - spring * y
        return second, gain * rise - damping * second - spring * p

    (y, p), (next_y, next_p) = first, last
    q, r = bends(y, p, load)
    next_q, next_r = bends(next_y, next_p, load + rise)
    left = (next_y - (y + p + q / 2 + r / 6), next_p - (p + q + r / 2), next_q - (q + r), next_r - r)
    return [y, p, q / 2, r / 6, *(sum(w * x for w, x in zip(row, left, strict=True)) for row in _HIGHER)]


def turns(polynomial: list[Array]) -> tuple[Array, Array]:
    """Values (2, ...) of the highest point after the beginning of the step and of the lowest, and their parts of it.

    A cubic through both ends has the turns in closed form; a step of Newton's method goes to those of the motion.
    """
    p = polynomial[1]
    rates = [k * c for k, c in enumerate(polynomial)][1:]
    gap, next_p = sum(polynomial[1:]), sum(rates)
    end = polynomial[0] + gap
    c2, c3 = 3 * gap - 2 * p - next_p, p + next_p - 2 * gap
    root = jnp.sqrt(jnp.maximum(c2**2 - 3 * c3 * p, 0.0))
    signs = jnp.asarray([1.0, -1.0], p.dtype).reshape(2, *[1] * p.ndim)
    below = root[None] - signs * c2[None]
    s = jnp.clip(signs * p[None] / jnp.where(below == 0, 1.0, below), 0.0, 1.0)
    bend = 2 * c2[None] + 6 * c3[None] * s
    s = jnp.clip(s - _value(rates, s) / jnp.where(bend == 0, 1.0, bend), 0.0, 1.0)
    value, end = _value(polynomial, s), end[None]
    inside = signs * value > signs * end
    return jnp.where(inside, value, end), jnp.where(inside, s, 1.0)


def _value(polynomial, s):
    """Of a polynomial, lowest power first, at two rows of s (2, ...)."""
    value = polynomial[-1][None]
    for c in polynomial[-2::-1]:
        value = c[None] + s * value
    return value
