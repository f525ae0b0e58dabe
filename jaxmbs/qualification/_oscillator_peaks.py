"""Greatest and least outputs of many oscillators under one load, without storing their motions."""

import jax
import jax.numpy as jnp
from jax import lax
from jax.custom_derivatives import SymbolicZero
from jaxtyping import Array, Float

from ..runtime import small_call

#: Steps of a block of the derivative: the products with blocks and the steps within one cost alike.
BLOCK = 512


def peaks(
    load: Float[Array, " n"], whole: Float[Array, "2 4 f"], output: Float[Array, "2 f"]
) -> tuple[Float[Array, "2 f"], Float[Array, "2 f"]]:
    """Extremes (2, f) of outputs at the samples, zero among them, and the last states (2, f).

    Args:
        load: (n,) on each oscillator, straight between samples.
        whole: (2, 4, f), states after a step by (state, load before, rise).
        output: (2, f), by states.
    """
    return _peaks(load, whole, output)


@jax.custom_jvp
def _peaks(load, whole, output):
    extremes, _, state = _run(load, whole, output)
    return extremes, state


def _run(load, whole, output):
    """Extremes, the samples where they are, and the last states."""

    def run(given):
        load, whole, output = given
        zero = jnp.zeros_like(output)
        start = (zero, zero, jnp.zeros(output.shape, jnp.int32))

        def step(carry, sample):
            state, extremes, at = carry
            number, before, after = sample
            state = _advance(whole, state, before, after - before)
            y = jnp.sum(output * state, axis=0)
            beyond = jnp.stack([y > extremes[0], y < extremes[1]])
            return (state, jnp.where(beyond, y[None], extremes), jnp.where(beyond, number, at)), None

        samples = (jnp.arange(1, len(load), dtype=jnp.int32), load[:-1], load[1:])
        return lax.scan(step, start, samples)[0]

    state, extremes, at = small_call(run)((load, whole, output))
    return extremes, at, state


def _advance(whole, state, before, rise):
    return whole[:, 0] * state[0][None] + whole[:, 1] * state[1][None] + whole[:, 2] * before + whole[:, 3] * rise


def _peaks_jvp(given, dots):
    """Derivatives of the outputs at the samples of the extremes, which are held."""
    extremes, at, end = _run(*given)
    moves = [not isinstance(dot, SymbolicZero) for dot in dots]

    def of_moving(*moving):
        moving = iter(moving)
        return _values(at, *(next(moving) if m else x for x, m in zip(given, moves, strict=True)))

    pairs = [tuple(x for x, m in zip(xs, moves, strict=True) if m) for xs in (given, dots)]
    return (extremes, end), jax.jvp(of_moving, *pairs)[1]


_peaks.defjvp(_peaks_jvp, symbolic_zeros=True)


def _values(at, load, whole, output):
    """Outputs (2, f) at samples (2, f), zero at the first one, and the last states.

    The state after a block of steps is a product of its loads with a matrix that all blocks share; an output needs
    the state before its block and the steps from there.
    """
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

    end, before = lax.scan(pass_block, jnp.zeros_like(output), forced)
    found = jax.vmap(_outputs_inside, (0, None, None, None, None))(at + missing - 1, blocks, before, whole, output)
    return jnp.where(at > 0, found, 0.0), end


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


def _outputs_inside(steps, blocks, before, whole, output):
    """Outputs (f,) after numbers of steps (f,)."""
    block, inside = jnp.divmod(jnp.maximum(steps, 0), blocks.shape[-1])
    loads = jnp.moveaxis(blocks[:, block], -1, 0)
    state = jnp.take_along_axis(before, block[None, None], axis=0)[0]

    def step(state, numbered):
        number, (load, rise) = numbered
        longer = _times(whole[:, :2], state) + whole[:, 2] * load[None] + whole[:, 3] * rise[None]
        return jnp.where((number <= inside)[None], longer, state), None

    state = lax.scan(step, state, (jnp.arange(blocks.shape[-1], dtype=inside.dtype), loads))[0]
    return jnp.sum(output * state, axis=0)
