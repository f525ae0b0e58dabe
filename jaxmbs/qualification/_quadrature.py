"""Quadrature over frequency that is clustered at poles, so that no resonance can be missed.

The band is cut at the points of the tables, at the resonances, half a bandwidth beside each and half way between
them.  On every piece `f = p + d sinh(u)` with the nearest pole p + i d, and Gauss points in u: there the resonance is
a smooth `1 / cosh(u)`, however narrow it is.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

#: Gauss points of a piece.
ORDER = 24
#: Cuts of the whole band at equal ratios: powers of f are smooth on pieces of less than an octave or two.
CUTS = 8


class Quadrature(NamedTuple):
    """Nodes and weights of integrals over frequency.

    Attributes:
        frequencies, weights: (pieces, order) [Hz].
        ends: (pieces,) upper ends of the pieces, rising.
    """

    frequencies: Float[Array, "pieces order"]
    weights: Float[Array, "pieces order"]
    ends: Float[Array, " pieces"]


def pole_quadrature(breaks: Array, resonances: Array, halfwidths: Array, order: int = ORDER) -> Quadrature:
    """Nodes and weights between the least and the largest of the breaks.

    Args:
        breaks: (k,) [Hz] where the integrand has kinks, in any order; the integral follows them in derivatives.
        resonances, halfwidths: (m,) real parts and sizes of the imaginary parts of the poles [Hz]; constants.
    """
    resonances, halfwidths = lax.stop_gradient((resonances, halfwidths))
    low, high = jnp.min(breaks), jnp.max(breaks)
    d = jnp.maximum(halfwidths, 1e-9 * jnp.maximum(resonances, lax.stop_gradient(low)))
    p = jnp.sort(resonances)
    cuts = [resonances - d, resonances, resonances + d, (p[1:] + p[:-1]) / 2]
    ratios = jnp.asarray(np.arange(1, CUTS + 1) / (CUTS + 1), breaks.dtype)
    cuts = jnp.concatenate([*cuts, lax.stop_gradient(low * (high / low) ** ratios)])
    inside = (cuts > low) & (cuts < high)
    points = jnp.sort(jnp.concatenate([breaks, jnp.where(inside, cuts, low)]))
    start, end = points[:-1], points[1:]
    pole, width = _nearest_poles(*lax.stop_gradient((start, end)), resonances, d)
    x, w = (jnp.asarray(part, points.dtype) for part in np.polynomial.legendre.leggauss(order))
    u0, u1 = jnp.arcsinh((start - pole) / width), jnp.arcsinh((end - pole) / width)
    u = (u0 + u1)[:, None] / 2 + (u1 - u0)[:, None] / 2 * x[None]
    f = pole[:, None] + width[:, None] * jnp.sinh(u)
    weights = (u1 - u0)[:, None] / 2 * w[None] * width[:, None] * jnp.cosh(u)
    return Quadrature(f, weights, end)


def _nearest_poles(start, end, resonances, widths):
    """Resonance and halfwidth (pieces,) of the pole that is nearest to each piece in the complex plane."""
    gap = jnp.maximum(start[:, None] - resonances[None], resonances[None] - end[:, None])
    nearest = jnp.argmin(jnp.hypot(jnp.maximum(gap, 0.0), widths[None]), axis=1)
    return resonances[nearest], widths[nearest]
