"""Curves of dry friction over speed, smooth at rest too: coefficients by the square of the speed."""

import jax.numpy as jnp
from jax import Array


def brown_mcphee(square, static_ratio) -> Array:
    """Friction over sliding friction and w, `(tanh(4 w) + (static_ratio - 1) w / (w^2/4 + 3/4)^2) / w`.

    The top of the curve is at w = 1, the transition speed.  Source: Brown and McPhee 2016.

    Args:
        square: of the speed over the transition speed, `w^2` >= 0.
        static_ratio: breakaway over sliding friction.
    """
    return 4.0 * tanh_over(16.0 * square) + (static_ratio - 1.0) / (square / 4.0 + 0.75) ** 2


def smooth_coulomb(square, static_ratio) -> Array:
    """The same of `(1 + (static_ratio - 1) exp(-w^2 / 100)) tanh(w) / w`, a Stribeck bump over ten transition
    speeds."""
    return (1.0 + (static_ratio - 1.0) * jnp.exp(-square / 100.0)) * tanh_over(square)


def tanh_over(square) -> Array:
    """`tanh(x) / x` of the square of x, with its derivatives at zero."""
    small = square < 1e-3
    x = jnp.sqrt(jnp.where(small, 1.0, square))
    series = 1.0 - square * (1 / 3 - square * (2 / 15 - square * (17 / 315 - square * (62 / 2835))))
    return jnp.where(small, series, jnp.tanh(x) / x)
