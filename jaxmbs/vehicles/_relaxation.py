"""Deflections of the tread as states: relaxation of a tyre's forces, at standstill too.

At speed `u' = -V_slip - |V| u / sigma`: in steady rolling `u / sigma` is the slip.  Where the wheel nearly stands, a
deflection far beyond that of full grip slides away with the tread instead of growing without end, and a sliding speed
adds a little to it, so that a car that stops comes to rest on its tyres.  Off the road they vanish.
Source: Pacejka (2012), chapters 7.2 and 8.3.
"""

from typing import Any

import jax.numpy as jnp

from ._tyre_model import AbstractTyreModel, Slip

_LEAST_LENGTH = 0.1  # relaxation length over free radius, at least
_FULL_GRIP = 3.0  # slip of full grip, over that at which the straight slope would reach it


def passing_slips(
    model: AbstractTyreModel, slip: Slip, sliding: tuple[Any, Any], states: tuple[Any, Any] | None, damping: Any
) -> Slip:
    """The slip of deflections (along, across) [m], or of steady rolling without them.

    Args:
        slip: with load, camber, speed and direction.
        sliding: velocities of the tread over the road, along and across [m/s].
        damping: time [s], see `Tyre.tread_damping`.
    """
    if states is None:
        speed = rolling_speed(slip.speed, model.standstill_speed)
        return slip._replace(kappa=-sliding[0] / speed, tangent=sliding[1] / speed)
    lengths, still = _lengths(model, slip), damping * _standing(slip)
    kappa = (states[0] - still * sliding[0]) / lengths[0]
    return slip._replace(kappa=kappa, tangent=(states[1] + still * sliding[1]) / lengths[1])


def steady_deflections(model: AbstractTyreModel, slip: Slip, sliding: tuple[Any, Any]) -> tuple[Any, Any]:
    """Deflections (along, across) [m] of steady rolling; none of a wheel off the road."""
    lengths, speed = _lengths(model, slip), rolling_speed(slip.speed, model.standstill_speed)
    pressed = slip.load > 0.0
    along, across = -sliding[0] / speed * lengths[0], sliding[1] / speed * lengths[1]
    return jnp.where(pressed, along, 0.0), jnp.where(pressed, across, 0.0)


def deflection_rates(
    model: AbstractTyreModel, slip: Slip, sliding: tuple[Any, Any], states: tuple[Any, Any]
) -> tuple[Any, Any]:
    """Rates (along, across) [m/s] of the deflections; arguments as of `passing_slips`."""
    lengths, speed = _lengths(model, slip), jnp.abs(slip.speed)
    slopes, load = model.slopes(slip), _FULL_GRIP * jnp.maximum(slip.load, 1e-3)
    along = states[0] / lengths[0] * slopes.along / (slopes.grip_along * load)
    across = states[1] / lengths[1] * slopes.across / (slopes.grip_across * load)
    used = along * along + across * across
    over = jnp.sqrt(sliding[0] ** 2 + sliding[1] ** 2 + 1e-12) * _standing(slip) * jnp.maximum(used - 1.0, 0.0)
    pressed = slip.load > 0.0
    found = []
    for u, length, slide in zip(states, lengths, (-sliding[0], sliding[1]), strict=True):
        rolling = slide - (speed + over) * u / length
        lifted = -(speed + model.standstill_speed) * u / (_LEAST_LENGTH * model.free_radius(0.0))
        found.append(jnp.where(pressed, rolling, lifted))
    return found[0], found[1]


def _lengths(model, slip):
    """Relaxation lengths, which do not vanish with the load."""
    shortest = _LEAST_LENGTH * model.free_radius(0.0)
    along, across = model.relaxation_lengths(slip)
    return jnp.maximum(along, shortest), jnp.maximum(across, shortest)


def _standing(slip):
    """1 where the wheel stands, 0 where it rolls."""
    return 1.0 - slip.direction * slip.direction


def rolling_speed(speed: Any, slow: Any) -> Any:
    """Size of the speed, at least half of a slow one: exact above it."""
    size = jnp.abs(speed)
    return jnp.where(size > slow, size, 0.5 * (speed * speed / slow + slow))
