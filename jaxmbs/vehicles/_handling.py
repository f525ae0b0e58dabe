"""Numbers of driving manoeuvres from histories: step and sine steer, brake in a turn, slopes of steady turns."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..checks import any_concrete, shape_of
from ..errors import ModelError
from ..forces._fields import number
from ..math import _square as square
from ..reports import Report, Reported
from ..typing import ArrayLike, Scalar, ScalarLike
from ._reports import report_of_fields


class StepResponse(Reported, eqx.Module):
    """Response to a step of the steer angle.

    Attributes: steady: value at the end; gain: that over the steer angle; response_time: from half of the steer to
    nine tenths of the steady response [s]; peak: largest in the direction of the steady one; peak_time: from half of
    the steer [s]; overshoot: peak over steady, less one.
    """

    steady: Scalar
    gain: Scalar
    response_time: Scalar
    peak: Scalar
    peak_time: Scalar
    overshoot: Scalar

    def report(self) -> Report:
        return report_of_fields(self, steady="", gain="", response_time="s", peak="", peak_time="s", overshoot="")


def step_steer_response(
    t: ArrayLike, response: ArrayLike, steer: ScalarLike, start: ScalarLike = 0.0, before: ScalarLike = 0.0
) -> StepResponse:
    """Gain, response time, peak and overshoot of a yaw rate or a lateral acceleration after a step of the steer.

    Args:
        t: (n,) rising times [s], fine enough for a parabola through three of them.
        response: (n,), steady at the end.
        steer: the step, of the steering wheel or the wheels [rad].
        start: time at which half of the step is reached [s].
        before: response before the step.

    Raises: ModelError for times and responses of other shapes.  Source: ISO 7401 (2011), chapter 8.
    """
    t, x = _history(t, response)
    numbers = {"steer": steer, "start": start, "before": before}
    odd = [name for name, value in numbers.items() if shape_of(value) or any_concrete(_is_not_finite, value)]
    if odd:
        raise ModelError([f"{name} must be one finite number" for name in odd], "the manoeuvre")
    x = (x - number(before)) * jnp.sign(x[-1] - number(before))
    sign, steady = jnp.sign(number(response)[-1] - number(before)), x[-1]
    after = jnp.argmax(x >= 0.9 * steady)
    first = jnp.maximum(after - 1, 0)
    rise = x[after] - x[first]
    share = jnp.where(rise > 0.0, (0.9 * steady - x[first]) / jnp.where(rise > 0.0, rise, 1.0), 0.0)
    reached = t[first] + share * (t[after] - t[first])
    at, peak = _peak(t, x)
    where = (sign * steady, sign * steady / number(steer), reached - start, sign * peak, at - start)
    return StepResponse(*where, peak / steady - 1.0)


class SteerGain(Reported, eqx.Module):
    """Response to a sinusoidal steer angle: gain over the steer angle, and phase by which it leads [rad]."""

    gain: Scalar
    phase: Scalar

    def report(self) -> Report:
        return report_of_fields(self, gain="", phase="rad")


def sine_steer_response(t: ArrayLike, steer: ArrayLike, response: ArrayLike, frequency: ScalarLike) -> SteerGain:
    """Gain and phase of a response to a sinusoidal steer angle, by least squares over whole periods.

    Args:
        t: (n,) times [s], of one or more whole periods after the start has died out.
        steer, response: (n,).
        frequency: [Hz].

    Raises: ModelError for histories of other shapes.  Source: ISO 7401 (2011), chapter 9.
    """
    t, steer = _history(t, steer)
    _, response = _history(t, response)
    angle = 2.0 * np.pi * number(frequency) * t
    waves = jnp.stack([jnp.cos(angle), jnp.sin(angle), jnp.ones_like(t)], axis=1)
    given, found = (square.solve(waves.T @ waves, waves.T @ x) for x in (steer, response))
    gain = jnp.sqrt((found[0] ** 2 + found[1] ** 2) / (given[0] ** 2 + given[1] ** 2))
    across = found[0] * given[1] - found[1] * given[0]
    return SteerGain(gain, jnp.arctan2(across, found[0] * given[0] + found[1] * given[1]))


def slopes_over(lateral_acceleration: ArrayLike, values: ArrayLike) -> Array:
    """Slopes (n,) of a quantity by the lateral acceleration along a slow steady turn, by second-order differences.

    Of the roll angle it is the roll gradient; of the steer angle at a constant radius, or less `L / v^2` at a
    constant speed, the understeer gradient.

    Args: lateral_acceleration: (n,) rising or falling [m/s^2]; values: (n,).
    Raises: ModelError for histories of other shapes.  Source: ISO 4138 (2021), chapter 9.
    """
    x, y = _history(lateral_acceleration, values)
    h = jnp.diff(x)
    slope = jnp.diff(y) / h
    inner = (h[1:] * slope[:-1] + h[:-1] * slope[1:]) / (h[1:] + h[:-1])
    ends = (2.0 * slope[0] - inner[0])[None], (2.0 * slope[-1] - inner[-1])[None]
    return jnp.concatenate([ends[0], inner, ends[1]])


class BrakeInTurn(Reported, eqx.Module):
    """Braking in a turn: yaw rate over that of the same path at the speed, and greatest slip angle after its start.

    Attributes: yaw_ratio: one second after the start, above one: into the turn; greatest_yaw_ratio; slip_angle:
    greatest size [rad].
    """

    yaw_ratio: Scalar
    greatest_yaw_ratio: Scalar
    slip_angle: Scalar

    def report(self) -> Report:
        return report_of_fields(self, yaw_ratio="", greatest_yaw_ratio="", slip_angle="rad")


def brake_in_turn(
    t: ArrayLike, yaw_rate: ArrayLike, speed: ArrayLike, slip_angle: ArrayLike, radius: ScalarLike, start: ScalarLike
) -> BrakeInTurn:
    """Yaw of a car that brakes in a turn.

    Args:
        t: (n,) times [s], to one second after the start or longer.
        yaw_rate: (n,) [rad/s]; speed: (n,) forward [m/s]; slip_angle: (n,) of the centre of mass [rad].
        radius: of the path before it, with the sign of the yaw rate [m].
        start: of braking [s].

    Raises: ModelError for histories of other shapes.  Source: ISO 7975 (2019), chapter 8.
    """
    t, yaw = _history(t, yaw_rate)
    (_, v), (_, slip) = _history(t, speed), _history(t, slip_angle)
    ratio, braking = yaw * number(radius) / v, t >= start
    greatest = jnp.max(jnp.where(braking, ratio, -jnp.inf))
    return BrakeInTurn(jnp.interp(start + 1.0, t, ratio), greatest, jnp.max(jnp.where(braking, jnp.abs(slip), 0.0)))


def _is_not_finite(x):
    return ~np.isfinite(x)


def _history(t: Any, x: Any) -> tuple[Array, Array]:
    if len(shape_of(t)) != 1 or shape_of(t) != shape_of(x) or shape_of(t)[0] < 3:
        raise ModelError(
            [f"histories must be (n,) each, of three or more, not {shape_of(t)} and {shape_of(x)}"], "it"
        )
    if any_concrete(lambda t, x: ~np.isfinite(t) | ~np.isfinite(x), t, x):
        raise ModelError(["histories must be finite"], "it")
    return number(t), number(x)


def _peak(t, x):
    """Time and value of the greatest, by a parabola through three points."""
    k = jnp.clip(jnp.argmax(x), 1, len(x) - 2)
    near = jnp.stack([t[k - 1], t[k], t[k + 1]]) - t[k]
    values = jnp.stack([x[k - 1], x[k], x[k + 1]]) - x[k]
    left, right = values[0] / near[0], values[2] / near[2]
    bend = (right - left) / (near[2] - near[0])
    slope = left - bend * near[0]
    inside = bend < 0.0
    at = jnp.where(inside, -0.5 * slope / jnp.where(inside, bend, -1.0), near[jnp.argmax(values)])
    at = jnp.clip(at, near[0], near[2])
    return t[k] + at, x[k] + slope * at + bend * at * at
