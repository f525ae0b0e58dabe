"""One-sided linear law with a smooth beginning: zero below, x above, and three derivatives between."""

import jax.numpy as jnp
from jax import Array


def one_sided(x, width) -> Array:
    """`max(x, 0)` with a smooth corner: exact for |x| >= width, C3 between; `f(x) - f(-x) = x`."""
    p = _share(x, width)
    return jnp.where(x >= width, x, 2.0 * width * p**4 * (2.5 + p * (p - 3.0)))


def one_sided_slope(x, width) -> Array:
    """Derivative of `one_sided`, from 0 to 1."""
    p = _share(x, width)
    return p**3 * (10.0 + p * (6.0 * p - 15.0))


def one_sided_integral(x, width) -> Array:
    """Integral of `one_sided` from minus infinity."""
    p = _share(x, width)
    return jnp.where(x >= width, x**2 / 2 + width**2 / 14, 4.0 * width**2 * p**5 * (0.5 + p * (p / 7 - 0.5)))


def passive_sum(elastic, resisting) -> Array:
    """Elastic tension and damping that together are never negative: their plain sum down to half of the elastic one.

    Damping takes energy at every rate, as the sum is below the elastic tension wherever the damping is negative.
    """
    width = elastic / 2
    safe = jnp.where(width > 0, width, 1.0)
    return jnp.where(width > 0, one_sided(elastic + resisting, safe), 0.0)


def _share(x, width):
    """Part of the bend from -width to width that lies below x, from 0 to 1; no branch overflows."""
    y = x / width
    return 0.5 * (1.0 + jnp.where(jnp.abs(y) < 1.0, y, jnp.sign(y)))
