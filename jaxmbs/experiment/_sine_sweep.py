"""Slow sine sweeps: phase of a sweep, complex amplitudes by a tracking filter, linearity over force levels."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Complex, Float

from ..elements._base import as_real
from ..math import _square as square
from ..runtime import as_dtype
from ..typing import AnyArray, ArrayLike


def sweep_phase(time: ArrayLike, start: ArrayLike, end: ArrayLike, duration: ArrayLike) -> tuple[Array, Array]:
    """Phase [rad] and angular frequency [rad/s] of a sweep that rises linearly from `start` to `end` [rad/s].

    Source: S1 (41), Fig. 4.
    """
    time = as_real(time)
    start, end, duration = (as_dtype(x, time.dtype) for x in (start, end, duration))
    rate = (end - start) / duration
    return start * time + rate * time**2 / 2, start + rate * time


def sweep_amplitudes(
    signals: Float[AnyArray, "channels samples"],
    phase: Float[AnyArray, " samples"],
    centres: ArrayLike,
    width: int,
) -> Complex[Array, "centres channels"]:
    """Complex amplitudes A of signals `Re(A e^(i phase))` sampled during a sweep (tracking filter).

    A least-squares fit in a Hann window around each centre of an amplitude that is linear inside the window, and of a
    constant.  The ratio of two amplitudes is a transfer function at the frequency of the centre.  The sweep rate adds
    an error `-i w' B''(w) / 2`, of opposite sign on the way down, which cancels in the mean of a sweep up and one
    down.

    Args:
        phase: of the sweep, known from the generator or `sweep_phase` [rad].
        centres: (centres,) indices of samples, at least `width` from both ends.
        width: samples on each side, some periods of the lowest frequency.

    Source: S1 (41), Fig. 4.
    """
    centres = np.asarray(centres, int)
    if np.any(centres < width) or np.any(centres + width >= phase.shape[0]):
        raise ValueError(f"centres must be at least {width} samples from both ends of {phase.shape[0]}")
    offset = np.arange(-width, width + 1)
    signals, phase = jnp.asarray(signals), jnp.asarray(phase)
    tau = jnp.asarray(offset / max(width, 1), phase.dtype)
    window = jnp.asarray(_window(width), phase.dtype)

    def at(centre):
        cut = lax.dynamic_slice_in_dim(phase, centre - width, 2 * width + 1)
        cos, sin = jnp.cos(cut), jnp.sin(cut)
        basis = jnp.stack([cos, sin, tau * cos, tau * sin, jnp.ones_like(cos)], axis=1)
        here = lax.dynamic_slice_in_dim(signals, centre - width, 2 * width + 1, axis=1)
        weighted = basis * window[:, None]
        fit = square.solve(weighted.T @ basis, weighted.T @ here.T)
        return lax.complex(fit[0], -fit[1])

    return jax.lax.map(at, jnp.asarray(centres), batch_size=64)


def sweep_variance(noise: ArrayLike, width: int) -> Array:
    """Variance of the amplitudes of `sweep_amplitudes` for white noise with a standard deviation `noise` per sample.

    Source: S1 (41), Fig. 4.
    """
    w = _window(width)
    return jnp.asarray(noise) ** 2 * (4 * float(np.sum(w**2) / np.sum(w) ** 2))


def _window(width):
    return np.cos(np.pi * np.arange(-width, width + 1) / (2 * (width + 1))) ** 2


def nonlinearity(levels: ArrayLike) -> Float[Array, " frequencies"]:
    """Largest relative deviation (frequencies,) of transfer functions (levels, frequencies, ...) at several force
    levels.

    Zero for a linear structure; compare it with the noise.  Source: S1 (41), Fig. 5.
    """
    levels = jnp.asarray(levels)
    mean = jnp.mean(levels, axis=0)
    axes = tuple(range(2, levels.ndim))
    spread = jnp.max(jnp.sum(jnp.abs(levels - mean[None]) ** 2, axis=axes), axis=0)
    return jnp.sqrt(spread / jnp.sum(jnp.abs(mean) ** 2, axis=tuple(a - 1 for a in axes)))
