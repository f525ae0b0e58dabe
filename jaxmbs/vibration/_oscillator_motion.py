"""Motions of oscillators under one load that is straight between samples, and their values at given times."""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array, lax

from ..math._exponential import expm

#: Steps of a block: the products with blocks and the steps within one cost alike.
BLOCK = 512


class Oscillators(NamedTuple):
    """Oscillators `y'' + rate y' + square y = gain load + gain_of_slope (d load/dt)`, each (f,).

    The state is y and `v = y' - gain_of_slope load`, which has no jump where the load has one.
    """

    square: Array
    rate: Array
    gain: Array
    gain_of_slope: Array


def speed_scale(step: Array, oscillators: Oscillators) -> Array:
    """Scale (f,) of velocities, by which they are carried, a constant to differentiation."""
    square, step = lax.stop_gradient((jnp.maximum(oscillators.square, 0.0), step))
    return jnp.maximum(jnp.sqrt(square), 1 / step)


def transition(step: Array, oscillators: Oscillators, part: Array | float = 1.0) -> Array:
    """States (2, 4, ..., f) after a part (..., f) of a step by (y, v / scale, load, rise of it in the whole step)."""

    def matrix(part, scale, oscillator):
        square, rate, gain, gain_of_slope = oscillator
        zero = jnp.zeros_like(scale)
        slope = jnp.stack([-square / scale, -rate, (gain - rate * gain_of_slope) / scale, zero])
        rows = [jnp.stack([zero, scale, gain_of_slope, zero]), slope, jnp.stack([zero, zero, zero, 1 / step])]
        return expm(part * step * jnp.stack([*rows, jnp.zeros(4, scale.dtype)]))[:2]

    scale = speed_scale(step, oscillators)
    shape = (*jnp.shape(part)[:-1], *scale.shape)
    flat = jnp.broadcast_to(part, shape).reshape(-1, len(scale))
    found = jax.vmap(jax.vmap(matrix), (0, None, None))(flat, scale, oscillators)
    return jnp.moveaxis(found.reshape(*shape, 2, 4), (-2, -1), (0, 1))


def advance(matrix: Array, state: Sequence[Array] | Array, load: Array, rise: Array) -> list[Array]:
    """State after a step of a transition (2, 4, ...)."""
    return [m[0] * state[0] + m[1] * state[1] + m[2] * load + m[3] * rise for m in matrix]


def values(
    at: Array, part: Array, load: Array, step: Array, oscillators: Oscillators
) -> tuple[Array, tuple[Array, Array]]:
    """Turning values (2, f) in the parts (2, f) of steps of numbers (2, f), and the last y and v (f,), from rest.

    They are those of the parabola through value, rate and second derivative: so they have the derivatives of the
    turning points, whose times move, and not of the places given.
    The state after a block of steps is a product of its loads with a matrix that all blocks share; a value needs
    the state before its block and the steps from there.
    """
    whole, *within = jnp.moveaxis(
        transition(step, oscillators, jnp.concatenate([jnp.ones_like(part[:1]), part])), 2, 0
    )
    steps = len(load) - 1
    size = min(BLOCK, steps)
    count = -(-steps // size)
    missing = count * size - steps  # steps without load before the first one, from rest
    pairs = jnp.stack([load[:-1], jnp.diff(load)])
    blocks = jnp.pad(pairs, ((0, 0), (missing, 0))).reshape(2, count, size)
    power, kernel = _powers(whole, size)
    forced = jnp.einsum("jbs,skjf->bkf", blocks, kernel)

    def pass_block(state, own):
        return _times(power, state) + own, state

    end, before = lax.scan(pass_block, jnp.zeros_like(whole[:, 0]), forced)
    scale = speed_scale(step, oscillators)

    def turning(k, s, matrix):
        state, load, rise = _state_inside(k + missing, blocks, before, whole)
        y, v = advance(matrix, state, load, rise)
        return _turning_value(y, scale * v, load + s * rise, rise / step, (s > 0) & (s < 1), oscillators)

    return jax.vmap(turning)(at, part, jnp.stack(within)), (end[0], end[1] * scale)


def _turning_value(y, v, load, slope, is_inside, oscillators):
    rate = v + oscillators.gain_of_slope * load
    force = oscillators.gain * load + oscillators.gain_of_slope * slope
    bend = force - oscillators.rate * rate - oscillators.square * y
    turns = is_inside & (bend != 0)
    return y - jnp.where(turns, 0.5 * rate**2 / jnp.where(turns, bend, 1.0), 0.0)


def _times(matrices, state):
    return matrices[:, 0] * state[0][None] + matrices[:, 1] * state[1][None]


def _powers(whole, size):
    """Transition (2, 2, f) of a block of steps, and states (size, 2, 2, f) at its end by the load of each step."""

    def step(carry, _):
        power, kernel = carry
        longer = [jax.vmap(_times, (None, 1), 1)(whole, x) for x in (power, kernel)]
        return tuple(longer), kernel

    eye = jnp.broadcast_to(jnp.eye(2, dtype=whole.dtype)[:, :, None], (2, 2, whole.shape[-1]))
    (power, _), kernels = lax.scan(step, (eye, whole[:, 2:]), None, length=size, reverse=True)
    return power, kernels


def _state_inside(at, blocks, before, whole):
    """States (2, f) before steps of numbers (f,), the loads there and their rises."""
    block, inside = jnp.divmod(at, blocks.shape[-1])
    loads = jnp.moveaxis(blocks[:, block], -1, 0)
    state = jnp.take_along_axis(before, block[None, None], axis=0)[0]

    def step(state, numbered):
        number, (load, rise) = numbered
        return jnp.where((number < inside)[None], jnp.stack(advance(whole, state, load, rise)), state), None

    state = lax.scan(step, state, (jnp.arange(blocks.shape[-1], dtype=inside.dtype), loads))[0]
    load, rise = jnp.take_along_axis(loads, inside[None, None], axis=0)[0]
    return state, load, rise
