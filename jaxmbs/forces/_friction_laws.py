"""Equations that all laws of dry friction share: coefficients over the speed of slip, and the rate of bristles."""

import jax.numpy as jnp


def tanh_over(square):
    """`tanh(x) / x` of the square of x, with its derivatives at zero."""
    small = square < 1e-3
    x = jnp.sqrt(jnp.where(small, 1.0, square))
    series = 1.0 - square * (1 / 3 - square * (2 / 15 - square * (17 / 315 - square * (62 / 2835))))
    return jnp.where(small, series, jnp.tanh(x) / x)


def coulomb_over_speed(square, rise):
    """Smooth Coulomb friction over the speed, of sliding friction and transition speed one, from the squared speed
    and the rise of breakaway over sliding friction."""
    return (1.0 + rise * jnp.exp(-square / 100.0)) * tanh_over(square)


def brown_mcphee_over_speed(square, rise):
    """The same of Brown and McPhee 2016, whose top is at the transition speed."""
    return 4.0 * tanh_over(16.0 * square) + rise / (square / 4.0 + 0.75) ** 2


def bristle_rate(v, speed, z, bend):
    """Rate `v - |v| z / bend` of bristles that are bent by z, of a slip v; bend: theirs in steady slip."""
    return v - speed * z / bend
