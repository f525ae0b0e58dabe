"""Steady turns of a single-track car with whole curves of its tyres, by Newton's method in steer and slip."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax

from ..math import _square as square
from ..reports import Report, Reported
from ..typing import Scalar
from ._reports import report_of_fields

_ROUNDS = 30  # of Newton's method, from the linear car
_TOLERANCE = 1e-9  # of the balance, over the weight


class SteadyTurn(Reported, eqx.Module):
    """A steady turn.

    Attributes: steer: angle of the front wheels [rad]; side_slip: lateral over forward speed of the centre of mass;
    yaw_rate [rad/s]; understeer: slope of the steer angle by the lateral acceleration at this speed, less
    `L / v^2` [rad s^2/m].
    """

    steer: Scalar
    side_slip: Scalar
    yaw_rate: Scalar
    understeer: Scalar

    def report(self) -> Report:
        return report_of_fields(self, steer="rad", side_slip="", yaw_rate="rad/s", understeer="rad s^2/m")


def steady_turn(car: Any, speed: Any, acceleration: Any) -> SteadyTurn:
    """Source: Pacejka (2012), chapter 1.3.3."""
    solve = lambda a: _balanced(car, speed, a)
    (steer, slip), (slope, _) = jax.jvp(solve, (acceleration,), (jnp.ones_like(acceleration),))
    return SteadyTurn(steer, slip / speed, acceleration / speed, slope - car.wheelbase / speed**2)


def _balanced(car, speed, acceleration):
    """Steer angle [rad] and lateral speed [m/s]."""
    front, rear = car.axles()
    yaw_rate, weight = acceleration / speed, car.mass * car.gravity

    def lack(x, yaw_rate):
        steer, slip = x
        c, s, side = jnp.cos(steer), jnp.sin(steer), slip + car.a * yaw_rate
        ahead = front.side_force((c * side - s * speed) / (c * speed + s * side)) * c
        behind = rear.side_force((slip - car.b * yaw_rate) / speed)
        sums = ahead + behind - car.mass * speed * yaw_rate, (car.a * ahead - car.b * behind) / car.wheelbase
        return jnp.stack(sums) / weight

    def step(x, yaw_rate):
        return x - square.solve(jax.jacfwd(lack)(x, yaw_rate), lack(x, yaw_rate))

    gains = car.gains(speed)
    first = acceleration / gains[2]
    fixed = lax.stop_gradient(yaw_rate)
    start = lax.stop_gradient(jnp.stack([first, first * gains[1] * speed]))
    x = lax.fori_loop(0, _ROUNDS, lambda _, x: lax.stop_gradient(step(x, fixed)), start)
    x = step(lax.stop_gradient(x), yaw_rate)  # the last step carries the derivatives
    return jnp.where(jnp.max(jnp.abs(lack(x, yaw_rate))) < _TOLERANCE, x, jnp.nan)
