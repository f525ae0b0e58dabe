"""Actuators of MuJoCo: affine in control, length and rate, with an activation of first order, and saturated."""

from collections.abc import Callable
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp

from ...checks import any_concrete, faults_if
from ...drawings import Drawing, Symbol
from ...forces import AbstractBodyLaw, AbstractScalarLaw, InternalState
from ...forces._fields import number, optional_number
from ...forces._internal_state import States
from ...forces._signals import as_signal
from ...typing import Array, Convertible, Matrix3, Scalar, ScalarLike, Vector3

_UNLIMITED = (-jnp.inf, jnp.inf)
ACTIVATIONS = ("none", "integrator", "filter")


class ServoActuator(AbstractScalarLaw):
    """Effort `gear F`, `F = (gain . (1, l, l')) a + bias . (1, l, l')` within its range, of the length `l = gear x`.

    The activation a is the control u within its range, or the internal state "activation": its integral, or what a
    filter of the first order makes of it, `da/dt = (u - a) / time_constant`.  A motor has the gain (1, 0, 0), a
    position servo gain (kp, 0, 0) and bias (0, -kp, -kv), a damper gain (0, 0, -kv).

    Attributes:
        control: u, a number or a function of time; a block may drive it.
        gain, bias: (3,).
        gear: of length and effort.
        control_range, force_range, activation_range: (2,), infinite where there is none.
        activation: "none", "integrator" or "filter".
        time_constant: of the filter > 0 [s].

    Source: MuJoCo documentation, "Actuation model".
    """

    unbounded: ClassVar[tuple[str, ...]] = ("control_range", "force_range", "activation_range")
    inputs: ClassVar[tuple[str, ...]] = ("control",)
    is_source: ClassVar[bool] = True

    control: Convertible[Callable[..., Any]] = eqx.field(converter=as_signal)
    gain: Convertible[Vector3] = eqx.field(converter=number, default=(1.0, 0.0, 0.0))
    bias: Convertible[Vector3] = eqx.field(converter=number, default=(0.0, 0.0, 0.0))
    gear: Convertible[Scalar] = eqx.field(converter=number, default=1.0)
    control_range: Convertible[Array] = eqx.field(converter=number, default=_UNLIMITED)
    force_range: Convertible[Array] = eqx.field(converter=number, default=_UNLIMITED)
    activation_range: Convertible[Array] = eqx.field(converter=number, default=_UNLIMITED)
    activation: str = eqx.field(static=True, default="none")
    time_constant: Convertible[Scalar | None] = eqx.field(converter=optional_number, default=None)

    @property
    def internal_states(self) -> dict[str, InternalState]:
        """The activation, unless it is the control itself."""
        return {} if self.activation == "none" else {"activation": InternalState()}

    @property
    def stores(self) -> bool:
        """False: all its work is input."""
        return False

    def rate(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> States:
        """Rate of the activation, none beyond its range."""
        a, u = s["activation"], self._command(t)
        rate = u if self.time_constant is None else (u - a) / self.time_constant
        low, high = self.activation_range
        stopped = ((a >= high) & (rate > 0)) | ((a <= low) & (rate < 0))
        return {"activation": jnp.where(stopped, 0.0, rate)}

    def effort(self, x: ScalarLike, v: ScalarLike, *s_and_t: Any) -> Scalar:
        """`gear F` [N or N m], of (x, v, t), with an activation of (x, v, s, t)."""
        *states, t = s_and_t
        a = jnp.clip(states[0]["activation"], *self.activation_range) if states else self._command(t)
        return self.gear * self.force(self.gear * x, self.gear * v, a)

    def force(self, length: ScalarLike, rate: ScalarLike, activation: ScalarLike) -> Scalar:
        """F [N or N m]."""
        gain = self.gain[0] + self.gain[1] * length + self.gain[2] * rate
        bias = self.bias[0] + self.bias[1] * length + self.bias[2] * rate
        return jnp.clip(gain * activation + bias, *self.force_range)

    def _command(self, t):
        return jnp.clip(number(self.control(t)), *self.control_range)

    def faults(self) -> list[str]:
        """The kind of activation is known, ranges have an order."""
        ranges = [getattr(self, name) for name in self.unbounded]
        return super().faults() + faults_if(
            (self.activation not in ACTIVATIONS, f"activation is one of {', '.join(ACTIVATIONS)}"),
            (
                (self.activation == "filter") is (self.time_constant is None),
                "a filter, and nothing else, takes a time_constant",
            ),
            (any(any_concrete(lambda r: r[0] > r[1], r) for r in ranges), "a range is (lower, upper)"),
        )


class SiteActuator(AbstractBodyLaw):
    """A `ServoActuator` without states whose force and moment are fixed in the axes of a frame, as of a thruster.

    Attributes:
        servo: its length is zero, its rate that of the frame along `direction`.
        direction: (6,) force, then moment, in the axes of the frame, for one unit of its effort.
    """

    servo: ServoActuator
    direction: Convertible[Array] = eqx.field(converter=number)

    def wrench(
        self, rotation: Matrix3, position: Vector3, angular_velocity: Vector3, velocity: Vector3, t: ScalarLike
    ) -> tuple[Vector3, Vector3]:
        """Force and moment, which turn with the frame."""
        force, moment = rotation @ self.direction[:3], rotation @ self.direction[3:]
        rate = jnp.dot(force, velocity) + jnp.dot(moment, angular_velocity)
        effort = self.servo.effort(jnp.zeros_like(rate), rate, t)
        return effort * force, effort * moment

    def drawing(self) -> Drawing:
        """An actuator."""
        return (Symbol("actuator"),)
