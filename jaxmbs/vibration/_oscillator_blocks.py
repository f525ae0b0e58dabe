"""One pass over the samples: states of oscillators before blocks of steps, and bounds of their values in these."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array, lax

from ..runtime import small_call
from ._oscillator_bounds import BoundFactors, free_state, free_turn, motion_state, overshoot
from ._oscillator_motion import advance

_GROUP = 32  # oscillators of one pass: a batch fills the vector units, and neighbours are of a kind
#: Radians in a step. Above, motions leave their samples by a third, and their envelopes are followed in place of
#: them; below, the free motion is too small a difference of motion and rest to be followed.
_FAST, _SLOW = 1.4, 1e-3


class Blocks(NamedTuple):
    """Loads (blocks, size) before steps, their rises in them, and states y, v (blocks, f) before blocks."""

    load: Array
    rise: Array
    y: Array
    v: Array


def pass_samples(
    load: Array, rise: Array, whole: Array, factors: BoundFactors
) -> tuple[tuple[Array, Array], Blocks, Array]:
    """The last state, blocks, and bounds (2, blocks, f) of the values in them and of their negatives.

    Args: loads (blocks, size) before steps and rises in them, the `transition` (2, 4, f) of a step.
    """
    count = whole.shape[-1]
    size = min(_GROUP, count)

    def split(x):
        padded = jnp.pad(x, [(0, 0)] * (x.ndim - 1) + [(0, -count % size)], mode="edge")
        return jnp.moveaxis(padded.reshape(*x.shape[:-1], -1, size), -2, 0)

    def run(given):
        loads, groups = given
        return lax.map(lambda group: _pass_group(loads, *group), groups)

    ends, starts, bounds = small_call(run)(((load, rise), jax.tree.map(split, (whole, factors))))
    ends, starts, bounds = (
        jnp.moveaxis(x, 0, -2).reshape(*x.shape[1:-1], -1)[..., :count] for x in (ends, starts, bounds)
    )
    return tuple(ends), Blocks(load, rise, *starts), bounds


def _pass_group(loads, whole, factors):
    phase = factors.phase
    is_free = jnp.all(factors.has_envelope & (phase > _SLOW)) & jnp.any(phase > _FAST)
    return lax.cond(is_free, _pass_free_motions, _pass_motions, loads, whole, factors)


def _pass_motions(loads, whole, factors):
    """Bounds by the values at samples, and by what the motions may exceed them."""

    def block(state, pairs):
        def one(carry, pair):
            y, v = advance(whole, carry[:2], *pair)
            return (y, v, jnp.maximum(carry[2], y), jnp.minimum(carry[3], y)), None

        y, v, high, low = lax.scan(one, (*state, state[0], state[0]), pairs)[0]
        return (y, v), (*state, high, low)

    zero = jnp.zeros_like(whole[0, 0])
    end, (y, v, high, low) = lax.scan(block, (zero, zero), loads)
    load, rise = loads
    sizes = (jnp.max(x, axis=1)[:, None] for x in (jnp.maximum(jnp.abs(load), jnp.abs(load + rise)), jnp.abs(rise)))
    beyond = overshoot(factors, jnp.maximum(high, -low), *sizes)
    return jnp.stack(end), jnp.stack([y, v]), jnp.stack([high, -low]) + beyond[None]


def _pass_free_motions(loads, whole, factors):
    """Bounds by the envelopes of the free motions about the moving positions at rest.

    A step turns and damps their states (p, q); where the slope of the load changes, so do rest and its rate.
    The first block, where the load may begin by a jump, is passed by its motion, and always searched.
    """
    load, rise = loads
    rest, speed = factors.rest, factors.speed
    zero = jnp.zeros_like(whole[0, 0])

    def one(state, pair):
        return tuple(advance(whole, state, *pair)), None

    first = lax.scan(one, (zero, zero), (load[0], rise[0]))[0]
    before = jnp.concatenate([jnp.zeros(1, rise.dtype), rise.ravel()[:-1]]).reshape(rise.shape)
    turn = free_turn(whole, speed[0])
    kick = -rest[1], -speed[2]
    (along, climb), across = rest, jnp.abs(rest[0])

    def block(state, steps):
        def one(carry, step):
            p, q, above, below = carry
            middle, half, rise, bend = step
            p, q = p + kick[0] * bend, q + kick[1] * bend
            at_rest, reach = along * middle + climb * rise, jnp.sqrt(p * p + q * q) + across * half
            p, q = (m[0] * p + m[1] * q for m in turn)
            return (p, q, jnp.maximum(above, at_rest + reach), jnp.minimum(below, at_rest - reach)), None

        nothing = jnp.full_like(zero, jnp.inf)
        p, q, above, below = lax.scan(one, (*state, -nothing, nothing), steps)[0]
        return (p, q), (*state, above, below)

    begin = free_state(first, load[0, -1] + rise[0, -1], rise[0, -1], rest, speed)
    steps = tuple(x[1:] for x in (load + 0.5 * rise, 0.5 * jnp.abs(rise), rise, rise - before))
    end, (p, q, above, below) = lax.scan(block, begin, steps)
    starts = motion_state((p, q), load[1:, :1], before[1:, :1], *jax.tree.map(lambda x: x[None], (rest, speed)))
    end = motion_state(end, load[-1, -1] + rise[-1, -1], rise[-1, -1], rest, speed)
    starts = jnp.pad(jnp.stack(starts), ((0, 0), (1, 0), (0, 0)))
    bounds = jnp.pad(jnp.stack([above, -below]), ((0, 0), (1, 0), (0, 0)), constant_values=jnp.inf)
    return jnp.stack(end), starts, bounds
