"""One-sided linear law with a smooth beginning: zero below, x above, and three derivatives between."""

import jax.numpy as jnp
from jax import Array


def one_sided(x, width) -> Array:
    """`max(x, 0)` with a smooth corner: exact for |x| >= width, C3 between; `f(x) - f(-x) = x`."""
    y = _inside(x, width)
    bend = width * (y / 2 + 15 / 16 * y**2 * (1 / 2 - y**2 / 6 + y**4 / 30) + 5 / 32)
    return jnp.where(x >= width, x, jnp.where(x <= -width, 0.0, bend))


def one_sided_slope(x, width) -> Array:
    """Derivative of `one_sided`, from 0 to 1."""
    y = _inside(x, width)
    bend = 1 / 2 + 15 / 16 * y * (1 - 2 * y**2 / 3 + y**4 / 5)
    return jnp.where(x >= width, 1.0, jnp.where(x <= -width, 0.0, bend))


def one_sided_integral(x, width) -> Array:
    """Integral of `one_sided` from minus infinity."""
    y = _inside(x, width)
    bend = y**2 / 4 + 15 / 16 * y**3 * (1 / 6 - y**2 / 30 + y**4 / 210) + 5 / 32 * y + 1 / 28
    above = x**2 / 2 + width**2 / 14
    return jnp.where(x >= width, above, jnp.where(x <= -width, 0.0, width**2 * bend))


def passive_sum(elastic, resisting) -> Array:
    """Elastic tension and damping that together are never negative: their plain sum down to half of the elastic one.

    Damping takes energy at every rate, as the sum is below the elastic tension wherever the damping is negative.
    """
    width = elastic / 2
    safe = jnp.where(width > 0, width, 1.0)
    return jnp.where(width > 0, one_sided(elastic + resisting, safe), 0.0)


def _inside(x, width):
    """x / width, held between -1 and 1 so that no branch overflows."""
    y = x / width
    return jnp.where(jnp.abs(y) < 1.0, y, jnp.sign(y))
