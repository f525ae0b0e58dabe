"""Shock spectra, exact between samples, beside a loop of the maxima at the samples alone, by kinds of records.

Sixty thousand samples and a hundred oscillators, with those far below the sampling rate ("low", up to a tenth of it)
and those near half of it apart ("high").  CPU time, warm, without compiling.
"""

import common
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from jaxmbs.qualification import shock_spectrum
from jaxmbs.runtime import small_call
from jaxmbs.vibration._oscillator_motion import Oscillators, advance, transition

STEP, Q = 1e-4, 10.0


def records(samples):
    t = np.arange(samples) * STEP
    noise = np.random.default_rng(1).normal(size=samples)
    half = samples * STEP / 2
    return {
        "white noise": noise,
        "smooth noise": np.convolve(noise, np.ones(8) / 8, "same"),
        "burst of noise": noise * np.exp(-(((t - half / 3) / (half / 10)) ** 2)),
        "half sine": np.where(t < 0.011, np.sin(np.pi * t / 0.011), 0.0),
        "sine sweep": np.sin(2 * np.pi * (10 * t + 1500 / (2 * half) * t**2)),
        "steady sine": np.sin(2 * np.pi * 800 * t),
    }


def at_samples(signal, f):
    """Maximax spectrum from the values at the samples."""
    omega = 2 * jnp.pi * f
    found = Oscillators(omega**2, omega / Q, omega**2, omega / Q)
    matrix = transition(jnp.asarray(STEP), found)

    def run(given):
        loads, matrix = given
        zero = jnp.zeros_like(matrix[0, 0])

        def one(carry, pair):
            y, v = advance(matrix, carry[:2], *pair)
            return (y, v, jnp.maximum(carry[2], y), jnp.minimum(carry[3], y)), None

        return lax.scan(one, (zero,) * 4, loads)[0]

    _, _, high, low = small_call(run)(((signal[:-1], jnp.diff(signal)), matrix))
    return jnp.maximum(high, -low)


def exact(signal, f):
    return shock_spectrum(signal, STEP, f, Q).maximax


def gradient(spectrum):
    return jax.value_and_grad(lambda signal, f: jnp.sum(spectrum(signal, f)))


def range_rows(name, limits, quick):
    samples, count = (2001, 8) if quick else (60_001, 100)
    f = jnp.geomspace(*limits, count)
    signals = {kind: jnp.asarray(x) for kind, x in records(samples).items()}
    some = signals["white noise"]
    programs = [common.compiled(function, some, f)[0] for function in (at_samples, exact, gradient(exact))]
    rows = []
    for kind, signal in signals.items():
        run = {str(i): lambda p=p, s=signal: p(s, f) for i, p in enumerate(programs)}
        times = common.cpu_seconds(run, 1 if quick else 7, 0.0)
        for metric, ours, goal in (("value", "1", "<=1.5"), ("with gradient", "2", "<=3.5")):
            peer = ("samples alone", times["0"], goal)
            rows.append(common.row(f"{kind}, {name}", metric, times[ours], "s CPU", *peer))
    return rows


CASES = {
    "low": lambda quick: range_rows("low", (10.0, 1000.0), quick),
    "high": lambda quick: range_rows("high", (1000.0, 4900.0), quick),
}


if __name__ == "__main__":
    common.run_cases(__doc__, CASES)
