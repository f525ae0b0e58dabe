"""Probabilities of several correlated normal numbers at once: all below their limits, or any above.

Genz' separation of variables: each number is drawn below its limit, given those before it.  What is integrated lies
between zero and one and is never a difference, so that small probabilities keep their digits.

Source: Genz 1992, Numerical computation of multivariate normal probabilities.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax
from jax.scipy.special import ndtr, ndtri
from jaxtyping import Float

from ..runtime import lapack

_POWER = 14  # of two, the number of points for three numbers and more: three digits of rare events, more of others
_LEAST = 1e-12  # share of a number's variance that is its own: numbers that are one keep a factor


def all_below(limits: Float[Array, " m"], correlation: Float[Array, "m m"]) -> Array:
    """Probability () that m standard normal numbers lie below their limits, all of them."""
    m = limits.shape[0]
    if m == 1:
        return ndtr(limits[0])
    least = max(_LEAST, 8.0 * float(jnp.finfo(correlation.dtype).eps))
    L = lapack.cholesky(jnp.where(np.eye(m, dtype=bool), 1.0, (1.0 - least) * correlation))
    points, weights = _parted_line(limits, L) if m == 2 else _sequence(m - 1)

    def product(w):
        drawn, share = [], 1.0
        for i in range(m):
            before = sum((L[i, j] * y for j, y in enumerate(drawn)), 0.0)
            part = ndtr((limits[i] - before) / L[i, i])
            share = share * part
            if i < m - 1:
                drawn.append(ndtri(jnp.maximum(w[i] * part, 1e-300)))
        return share

    return jnp.sum(jnp.asarray(weights) * jax.vmap(product)(jnp.asarray(points)))


def any_above(limits: Float[Array, " m"], correlation: Float[Array, "m m"]) -> Array:
    """Probability () that any of m standard normal numbers lies above its limit: the first, or the second and not the
    first, and so on."""
    parts = []
    for k in range(limits.shape[0]):
        order = np.array([k, *range(k)])
        sign = jnp.asarray(np.where(np.arange(k + 1) == 0, -1.0, 1.0))
        parts.append(all_below(sign * limits[order], sign[:, None] * sign[None] * correlation[order[:, None], order]))
    return sum(parts[1:], parts[0])


def _parted_line(limits, L):
    """Points (2 k, 1) and weights between 0 and 1, close to where the second of two numbers reaches its limit: a step
    where they are correlated by nearly one, of which the ends of the rule have all digits."""
    points, weights = (jnp.asarray(part) for part in _line())
    slope = jnp.where(jnp.abs(L[1, 0]) > 1e-8, L[1, 0], 1e-8)
    step = lax.stop_gradient(jnp.clip(ndtr(limits[1] / slope) / jnp.maximum(ndtr(limits[0]), 1e-300), 0.0, 1.0))
    both = jnp.concatenate([step * points, 1.0 - (1.0 - step) * points])
    return both, jnp.concatenate([step * weights, (1.0 - step) * weights])


@functools.cache
def _line():
    """Points (k, 1) and weights of the tanh-sinh rule between 0 and 1, of functions with steep ends."""
    t = np.linspace(-3.4, 3.4, 121)
    z = np.pi * np.sinh(t)
    weights = (t[1] - t[0]) * np.pi * np.cosh(t) * np.exp(-np.logaddexp(0.0, z) - np.logaddexp(0.0, -z))
    return np.exp(-np.logaddexp(0.0, -z))[:, None], weights / np.sum(weights)


@functools.cache
def _sequence(dimension):
    """Points (k, dimension) of Sobol's sequence between 0 and 1, and their weights."""
    from scipy.stats import qmc

    return qmc.Sobol(dimension, seed=0).random_base2(_POWER), np.full(2**_POWER, 0.5**_POWER)
