"""Vibration response spectrum: oscillators on a base with a random acceleration."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import faults_if, not_positive
from ..errors import ModelError
from ..fatigue._arrays import float_array
from ..fatigue._log_lines import frequency_faults
from ..runtime import as_dtype, jit
from ..typing import ArrayLike

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(96)


def random_spectrum(
    frequencies: ArrayLike, levels: ArrayLike, natural: ArrayLike, Q: ArrayLike = 10.0
) -> Float[Array, " f"]:
    """Vibration response spectrum (f,): RMS of the absolute acceleration of oscillators on a random base.

    Args:
        frequencies: (p,) [Hz], rising, > 0; one that stands twice is a step.
        levels: (p,) one-sided, [g^2/Hz] or [(m/s^2)^2/Hz], > 0, straight between the points on log-log paper, zero
            outside.
        natural: (f,) natural frequencies [Hz], > 0, or one.
        Q: amplification at resonance, > 0.5.

    The points of quadrature crowd about each resonance, so that no grid can miss it.  `miles` is the estimate for a
    flat spectrum.

    Raises: ModelError, if concrete, for numbers that are not positive and frequencies that do not increase.
    """
    table, levels, natural = float_array(frequencies), float_array(levels), jnp.atleast_1d(float_array(natural))
    faults = faults_if(
        (table.shape != levels.shape or table.ndim != 1 or table.size < 2, "give two rows of equal length"),
        (any(not_positive(x) for x in (table, levels, natural, Q)), "all numbers must be positive"),
    )
    faults += frequency_faults(table) if table.ndim == 1 and table.size > 1 else []
    if faults:
        raise ModelError(faults, "the spectrum")
    kind = levels.dtype
    return _rms(as_dtype(table, kind), levels, as_dtype(natural, kind), as_dtype(Q, kind))


@jit
def _rms(table, levels, natural, Q):
    step = jnp.diff(jnp.log(table))
    power = jnp.where(step > 0, jnp.diff(jnp.log(levels)) / jnp.where(step > 0, step, 1.0), 0.0)
    nodes, weights = (jnp.asarray(x, table.dtype) for x in (_NODES, _WEIGHTS))

    def variance(fn):
        width = fn / (2 * Q)
        angle = jnp.arctan((table - fn) / width)  # the resonance is flat over the angle
        half = 0.5 * jnp.diff(angle)
        at = 0.5 * (angle[1:] + angle[:-1])[:, None] + half[:, None] * nodes[None]
        f = fn + width * jnp.tan(at)
        level = levels[:-1, None] * (f / table[:-1, None]) ** power[:, None]
        r = f / fn
        gain = (1 + (r / Q) ** 2) / ((1 - r**2) ** 2 + (r / Q) ** 2)
        return jnp.sum(half * ((level * gain * width / jnp.cos(at) ** 2) @ weights))

    return jnp.sqrt(jax.vmap(variance)(natural))


def miles(natural: ArrayLike, levels: ArrayLike, Q: ArrayLike = 10.0) -> Array:
    """Miles' estimate `sqrt(pi / 2 f Q G)` of the RMS absolute acceleration of an oscillator, for a flat spectrum.

    Args: natural: [Hz]; levels: one-sided, at the natural frequencies [g^2/Hz]; Q: amplification at resonance.

    Raises: ValueError, if concrete, for numbers that are not positive.
    """
    if any(not_positive(x) for x in (natural, levels, Q)):
        raise ValueError("natural frequencies, levels and Q must be positive")
    f, g = float_array(natural), float_array(levels)
    return jnp.sqrt(0.5 * np.pi * f * as_dtype(g, f.dtype) * as_dtype(Q, f.dtype))
