"""Uncertainty of transfer functions and of what is computed from them, to first order."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

from ..checks import any_concrete, negative, not_positive, require_numbers
from ..runtime import as_dtype
from ..typing import ArrayLike


def coherence_variance(values: ArrayLike, coherence: ArrayLike, averages: ArrayLike) -> Array:
    """Variance `|B|^2 (1 - c) / (c n)` of the complex error of measured transfer functions, half in each part.

    Args:
        values: B, complex.
        coherence: c (ordinary coherence, gamma squared) of the same shape.
        averages: n, independent averages.

    Source: S1 (41); J. Bendat, A. Piersol, Random Data, single-input estimates with noise at the output.
    """
    values, coherence = jnp.asarray(values), jnp.asarray(coherence)
    averages = as_dtype(averages, coherence.dtype)
    if any_concrete(lambda c: (c < 0) | (c > 1), coherence) or not_positive(averages):
        raise ValueError("coherence must lie between 0 and 1, and averages must be positive")
    return jnp.abs(values) ** 2 * (1 - coherence) / (coherence * averages)


def noise_variance(values: ArrayLike, relative: ArrayLike = 0.0, floor: ArrayLike = 0.0) -> Array:
    """Variance of a noise model: relative to the magnitude (calibration, cross talk) plus a floor (sensors, cables).

    Args: relative, floor: numbers, or arrays that broadcast to the values' shape (of the same rank).

    Source: S1 (41).
    """
    require_numbers(values=values, relative=relative, floor=floor)
    values = jnp.asarray(values)
    relative, floor = (jnp.broadcast_to(as_dtype(a, values.real.dtype), values.shape) for a in (relative, floor))
    return jnp.abs(values) ** 2 * relative**2 + floor**2


def add_noise(key: Array, values: ArrayLike, variance: ArrayLike) -> Array:
    """Add circular complex noise of the given variance, independent from entry to entry; `key` seeds it."""
    require_numbers(values=values, variance=variance)
    values, variance = jnp.asarray(values), jnp.asarray(variance)
    parts = jax.random.normal(key, (2, *values.shape), values.real.dtype) * jnp.sqrt(variance / 2)[None]
    return values + lax.complex(parts[0], parts[1])


def propagate(function: Callable, values: ArrayLike, variance: ArrayLike) -> tuple[Array, Array]:
    """Value of a function of measured transfer functions, and the variance of each entry (first-order propagation).

    First order: `sum |d f / d B_ij|^2 var_ij`, the errors of entries and of frequencies being independent.  Two
    forward derivatives for each pair (output, input), whatever the number of frequencies.

    Args:
        function: of complex (frequencies, outputs, inputs); works frequency by frequency, so its result's first axis
            is that of frequencies too.  Real or complex results.
        values, variance: (frequencies, outputs, inputs).

    Returns: (value, variance), the variance of a complex entry being that of its complex error.  Source: S1 (41).
    """
    require_numbers(values=values, variance=variance)
    values, variance = jnp.asarray(values), jnp.asarray(variance)
    found = function(values)
    deviation = jnp.sqrt(variance / 2)
    outputs, inputs = values.shape[1:]

    def add(total, place):
        only = jnp.arange(outputs * inputs).reshape(1, outputs, inputs) == place
        size = jnp.where(only, deviation, 0.0)
        for tangent in (lax.complex(size, jnp.zeros_like(size)), lax.complex(jnp.zeros_like(size), size)):
            total = total + jnp.abs(jax.jvp(function, (values,), (tangent.astype(values.dtype),))[1]) ** 2
        return total, None

    start = jnp.zeros(found.shape, found.real.dtype)
    return found, lax.scan(add, start, jnp.arange(outputs * inputs))[0]


def propagate_scalar(
    function: Callable, values: ArrayLike, variance: ArrayLike
) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """Value and variance of a real function of all frequencies; one reverse pass gives all sensitivities.

    Args: as of `propagate`; the function gives a real scalar.  Source: S1 (41).
    """
    require_numbers(values=values, variance=variance)
    values, variance = jnp.asarray(values), jnp.asarray(variance)
    if negative(variance):
        raise ValueError("variance must not be negative")
    found, slope = jax.value_and_grad(function)(values)
    return found, jnp.sum(jnp.abs(slope) ** 2 * variance) / 2


def mean_of_repeats(samples: ArrayLike) -> tuple[Array, Array]:
    """Mean (...) and variance of the mean (...) of repeated measurements (repeats, ...), at least two.

    Source: S1 (41).
    """
    samples = jnp.asarray(samples)
    n = samples.shape[0]
    mean = jnp.mean(samples, axis=0)
    return mean, jnp.sum(jnp.abs(samples - mean[None]) ** 2, axis=0) / (n * (n - 1))
