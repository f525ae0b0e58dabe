"""Greatest and least values of many oscillators under one load, without storing their motions."""

import jax
import jax.numpy as jnp
from jax.custom_derivatives import SymbolicZero
from jaxtyping import Array, Float

from ._oscillator_blocks import pass_samples
from ._oscillator_bounds import bound_factors
from ._oscillator_motion import Oscillators, speed_scale, transition, values
from ._oscillator_search import PARTS, Extremes, search


def peaks(
    load: Float[Array, " n"], step: Array, oscillators: Oscillators
) -> tuple[Float[Array, "2 f"], tuple[Array, Array]]:
    """Extremes (2, f) from rest until the last sample, zero among them, and y and v (f,) there.

    Extremes are those of the motion, between the samples too, to 1e-7; at the samples and in their middles where

    Args:
        load: (n,), straight between samples.
        step: () time between samples [s], at most half a period.
    """
    return _peaks(load, step, oscillators)


@jax.custom_jvp
def _peaks(load, step, oscillators):
    found, end = _extremes(load, step, oscillators)
    return found.value, end


def _peaks_jvp(given, dots):
    """Derivatives of the extremes by the steps that they are in, which are held."""
    found, end = _extremes(*given)
    given, structure = jax.tree.flatten(given)
    dots = structure.flatten_up_to(dots)
    moves = [not isinstance(dot, SymbolicZero) for dot in dots]

    def of_moving(*moving):
        moving = iter(moving)
        leaves = [next(moving) if m else x for x, m in zip(given, moves, strict=True)]
        return values(found.at, found.part, *jax.tree.unflatten(structure, leaves))

    pairs = [tuple(x for x, m in zip(xs, moves, strict=True) if m) for xs in (given, dots)]
    return (found.value, end), jax.jvp(of_moving, *pairs)[1]


_peaks.defjvp(_peaks_jvp, symbolic_zeros=True)


def _extremes(load, step, oscillators):
    """Extremes, with the number of the step and the part of it, and the last y and v."""
    steps = len(load) - 1
    size = _block_size(steps)
    missing = -steps % size  # steps without load before the first one, from rest
    pairs = jnp.pad(jnp.stack([load[:-1], jnp.diff(load)]), ((0, 0), (missing, 0))).reshape(2, -1, size)
    scale = speed_scale(step / PARTS, oscillators)
    parts = _parts(transition(step / PARTS, oscillators))
    factors = bound_factors(scale, step, oscillators)
    end, blocks, bounds = pass_samples(*pairs, parts[0], factors)
    found = search(blocks, bounds, parts, scale, step, oscillators, factors)
    lost = ~jnp.all(jnp.isfinite(jnp.stack(end)), axis=0)  # of a load that is not finite
    value = jnp.where(lost[None], jnp.nan, jnp.stack([found.value[0], -found.value[1]]))
    return Extremes(value, jnp.maximum(found.at - missing, 0), found.part), (end[0], end[1] * scale)


def _parts(quarter):
    """Transitions (3, 2, 4, f) of a step, of half of it and of a quarter, each by the rise of the load in it."""
    half = _twice(quarter)
    return jnp.stack([_twice(half), half, quarter])


def _twice(matrix):
    """Transition (2, 4, f) of two steps of a straight load by the rise in both."""
    loads = jnp.asarray([[0.0, 0.0, 1.0, 0.5], [0.0, 0.0, 0.0, 0.5]], matrix.dtype)
    halves = jnp.asarray([1.0, 1.0, 1.0, 0.5], matrix.dtype)
    first = matrix * halves[None, :, None]
    loads = jnp.broadcast_to(loads[:, :, None], matrix.shape)
    return jnp.einsum("ijf,jkf->ikf", matrix, jnp.concatenate([first, loads]))


def _block_size(steps):
    """Power of two near half the root of the number of steps: as much to search as there are blocks."""
    return max(16, 1 << ((steps.bit_length() - 1) // 2))
