"""Search for the greatest and least values of oscillators, in those blocks and steps that can hold them."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..runtime import small_call
from ._oscillator_blocks import Blocks
from ._oscillator_bounds import BoundFactors, free_state, overshoot
from ._oscillator_motion import Oscillators, advance
from ._step_polynomial import REACH, step_polynomial, turns

PARTS = 4  # of each step at the highest frequencies, so that they are short of `REACH`
_NEAR = 1 + 1e-7  # bounds this close to an extreme are not searched
_GROUP = 4  # oscillators that are searched together: what one of them needs is done for all


class Extremes(NamedTuple):
    """Greatest values and those of the negative motions (2, f), their steps, and the parts of those until then."""

    value: Array
    at: Array
    part: Array


def search(
    blocks: Blocks,
    bounds: Array,
    parts: Array,
    scale: Array,
    step: Array,
    oscillators: Oscillators,
    factors: BoundFactors,
) -> Extremes:
    """Search the blocks by bounds (2, blocks, f) of the motions and of their negatives.

    Args: parts: `transition` (3, 2, 4, f) of a step, of half a step and of a quarter, velocities by the scale (f,).
    """
    count = len(scale)
    size = min(_GROUP, count)

    def split(x):
        padded = jnp.pad(x, [(0, 0)] * (x.ndim - 1) + [(0, -count % size)], mode="edge")
        return jnp.moveaxis(padded.reshape(*x.shape[:-1], -1, size), -2, 0)

    def run(given):
        (load, rise, step), groups = given

        def search_group(group):
            (y, v), *rest = group
            return _search_blocks(Blocks(load, rise, y, v), step, *rest)

        return lax.map(search_group, groups)

    per_oscillator = jax.tree.map(split, ((blocks.y, blocks.v), bounds, parts, scale, oscillators, factors))
    found = small_call(run)(((blocks.load, blocks.rise, step), per_oscillator))
    return Extremes(*(jnp.moveaxis(x, 0, -2).reshape(*x.shape[1:-1], -1)[..., :count] for x in found))


def _search_blocks(blocks, step, bounds, parts, scale, oscillators, factors):
    """The extremes, from blocks in the order of their bounds until none is above what is found."""
    none = jnp.zeros(bounds.shape[::2], bounds.dtype)
    nothing = Extremes(none, jnp.zeros(none.shape, jnp.int32), none)
    visit = _visit_step(step, parts, scale, oscillators)

    def search_block(found, which):
        load, rise = (jnp.moveaxis(x[which], -1, 0) for x in (blocks.load, blocks.rise))
        start = tuple(jnp.take_along_axis(x, which[None], axis=0)[0] for x in (blocks.y, blocks.v))

        def one(state, pair):
            after = tuple(advance(parts[0], state, *pair))
            return after, after

        after = lax.scan(one, start, (load, rise))[1]
        y, v = (jnp.concatenate([x[None], xs]) for x, xs in zip(start, after, strict=True))

        def search_step(found, k):
            state, pair = ([jnp.take_along_axis(x, k[None], axis=0)[0] for x in xs] for xs in ((y, v), (load, rise)))
            return visit(found, which * len(load) + k, state, *pair)

        return _in_order(search_step, found, _step_bounds(y, v[:-1], load, rise, factors))

    return _in_order(search_block, nothing, bounds)


def _step_bounds(y, v, load, rise, factors):
    """Bounds (2, size, f) of values and of their negatives in the steps of a block, from values (size + 1, f)."""
    rest, speed, has_envelope = jax.tree.map(lambda x: x[None], (factors.rest, factors.speed, factors.has_envelope))
    p, q = free_state((y[:-1], v), load, rise, rest, speed)
    middle = rest[0] * (load + 0.5 * rise) + rest[1] * rise
    reach = jnp.sqrt(p * p + q * q) + 0.5 * jnp.abs(rest[0] * rise)
    envelopes = jnp.where(has_envelope[None], jnp.stack([middle + reach, reach - middle]), jnp.inf)
    ends = jnp.stack([jnp.maximum(y[:-1], y[1:]), jnp.maximum(-y[:-1], -y[1:])])
    sizes = jnp.maximum(jnp.abs(load), jnp.abs(load + rise)), jnp.abs(rise)
    return jnp.minimum(ends + overshoot(factors, jnp.max(ends, axis=0), *sizes)[None], envelopes)


def _in_order(visit, found, bounds):
    """Extremes after visits of numbers (f,) in the order of bounds (2, n, f), until none is above them."""

    def above(carry):
        found, bounds = carry
        return jnp.max(bounds - _NEAR * found.value[:, None], axis=0)

    def next_one(carry):
        found, bounds = carry
        which = lax.argmax(above(carry), 0, jnp.int32)
        visited = jnp.arange(bounds.shape[1], dtype=jnp.int32)[None, :, None] == which[None, None]
        return visit(found, which), jnp.where(visited, -jnp.inf, bounds)

    return lax.while_loop(lambda carry: jnp.any(above(carry) > 0), next_one, (found, bounds))[0]


def _visit_step(step, parts, scale, oscillators):
    """Function that takes the extremes in steps to those found, cut into so many parts that a polynomial has them."""
    phase = step * jnp.max(jnp.maximum(jnp.sqrt(oscillators.square), 0.5 * oscillators.rate))
    halvings = sum((phase > reach).astype(jnp.int32) for reach in (REACH, 2 * REACH))
    matrix, count = parts[halvings], jnp.asarray(np.int32([1, 2, 4]))[halvings]
    number = count.astype(scale.dtype)
    h = step / number
    has_turns = ((oscillators.square * h**2 <= REACH**2) & (oscillators.rate * h <= 2 * REACH))[None]

    def rate(v, load):
        return h * (v * scale + oscillators.gain_of_slope * load)

    def visit(found, at, state, load, rise):
        climb = rise / number

        def search_part(inside, carry):
            (y, v), found = carry
            begin = load + inside.astype(scale.dtype) * climb
            after = tuple(advance(matrix, (y, v), begin, climb))
            first, last = (y, rate(v, begin)), (after[0], rate(after[1], begin + climb))
            value, s = turns(step_polynomial(first, last, begin, climb, h, oscillators))
            value, end = (jnp.stack([x[0], -x[-1]]) for x in (value, after[0][None]))
            value, s = jnp.where(has_turns, value, end), jnp.where(has_turns, s, 1.0)
            part = (inside.astype(scale.dtype) + s) / number
            new = Extremes(value, jnp.broadcast_to(at, value.shape), part)
            return after, Extremes(*(jnp.where(value > found.value, b, a) for a, b in zip(found, new, strict=True)))

        return lax.fori_loop(0, count, search_part, (tuple(state), found))[1]

    return visit
