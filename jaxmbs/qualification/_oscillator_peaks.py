"""Greatest and least outputs of many oscillators under one load, without storing their motions."""

import jax
import jax.numpy as jnp
from jax import lax
from jax.custom_derivatives import SymbolicZero
from jaxtyping import Array, Float

from ..runtime import small_call


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
    """Derivatives of the outputs at the samples of the extremes."""
    extremes, at, end = _run(*given)
    load, whole, output = given
    fixed = [isinstance(dot, SymbolicZero) for dot in dots]
    load_dot, whole_dot, output_dot = (
        jnp.zeros_like(x) if z else dot for x, z, dot in zip(given, fixed, dots, strict=True)
    )

    def step(carry, sample):
        state, dot, rates = carry
        number, before, after, before_dot, after_dot = sample
        dot = _advance(whole, dot, before_dot, after_dot - before_dot)
        if not fixed[1]:
            dot = dot + _advance(whole_dot, state, before, after - before)
        y_dot = jnp.sum(output * dot, axis=0)
        if not (fixed[1] and fixed[2]):
            state = _advance(whole, state, before, after - before)
            y_dot = y_dot + jnp.sum(output_dot * state, axis=0)
        return (state, dot, rates + jnp.where(at == number, y_dot[None], 0.0)), None

    zero = jnp.zeros_like(output)
    numbers = jnp.arange(1, len(load), dtype=jnp.int32)
    (_, end_dot, rates), _ = lax.scan(
        step, (zero, zero, zero), (numbers, load[:-1], load[1:], load_dot[:-1], load_dot[1:])
    )
    return (extremes, end), (rates, end_dot)


_peaks.defjvp(_peaks_jvp, symbolic_zeros=True)
