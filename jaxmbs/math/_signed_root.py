"""Flow law of an opening, smooth through zero; smooth ramps."""

import jax.numpy as jnp


def signed_root(drop, laminar):
    """Signed root of a pressure difference, linear below `laminar`: `d / (d^2 + laminar^2)^(1/4)`."""
    return drop * (drop**2 + laminar**2) ** -0.25


def smooth_ramp(x, width):
    """`max(x, 0)` with a parabola between -width and width: exact beyond, continuous slope."""
    parabola = jnp.square(x + width) / (4.0 * width)
    return jnp.where(x <= -width, 0.0, jnp.where(x >= width, x, parabola))


def smooth_step(x, width):
    """From 0 at -width to 1 at width by a cubic: continuous slope."""
    z = jnp.clip((x + width) / (2.0 * width), 0.0, 1.0)
    return z * z * (3.0 - 2.0 * z)
