"""An electric motor with the current of its winding."""

from collections.abc import Callable
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp

from ..checks import faults_if, negative, not_positive
from ..drawings import Drawing, Symbol
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractScalarLaw
from ._element_bonds import ElementBond, ElementBonds, electric
from ._fields import number, optional_number
from ._internal_state import InternalState, States
from ._signals import as_signal


class Motor(AbstractScalarLaw):
    """Direct-current motor, or a synchronous one by its torque-making current, behind a gear of some ratio.

    `inductance di/dt = voltage - resistance i - ke ratio v` and `effort = ratio kt i`: a gyrator between voltage and
    current on one side, speed and torque on the other. Its electric power counts as input. The inertia of its rotor
    is that of a body, which turns with the joint, or `SystemBuilder.rotor` for one behind a gear.

    Limits of torque and speed are those of its drive, which saturates the voltage: at `max_voltage`, so that the
    speed ends where `ke ratio v` reaches it, and where the current would pass that of `max_torque`. A current beyond
    it, as of a fast load, returns within a few times `limit_time` as far as the voltage suffices.

    Attributes:
        voltage: function of time or a number [V].
        resistance: >= 0 [ohm].
        inductance: > 0 [H].
        kt: torque constant [N m/A], of a linear motor [N/A].
        ke: voltage constant [V s/rad or V s/m]; default kt, as of a motor without losses in its gap.
        ratio: turns of the motor for one of the joint.
        max_voltage: > 0 [V]; default no limit.
        max_torque: > 0 of the motor before its gear [N m or N]; default no limit.
        limit_time: time in which the drive brings the current to its limit, > 0 [s].
    """

    voltage: Convertible[Callable[..., Any]] = eqx.field(converter=as_signal)
    resistance: Convertible[Scalar] = eqx.field(converter=number)
    inductance: Convertible[Scalar] = eqx.field(converter=number)
    kt: Convertible[Scalar] = eqx.field(converter=number)
    ke: Convertible[Scalar | None] = eqx.field(converter=optional_number, default=None)
    ratio: Convertible[Scalar] = eqx.field(converter=number, default=1.0)
    max_voltage: Convertible[Scalar | None] = eqx.field(converter=optional_number, default=None)
    max_torque: Convertible[Scalar | None] = eqx.field(converter=optional_number, default=None)
    limit_time: Convertible[Scalar] = eqx.field(converter=number, default=1e-3)
    is_source: ClassVar[bool] = True
    inputs: ClassVar[tuple[str, ...]] = ("voltage",)

    @property
    def internal_states(self) -> dict[str, InternalState]:
        return {"current": InternalState(unit="A")}

    def drawing(self) -> Drawing:
        """An actuator."""
        return (Symbol("actuator"),)

    def rate(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> States:
        """Rate of the current [A/s]."""
        return {"current": (self.voltage_at(v, s, t) - self._drop(v, s)) / self.inductance}

    def _drop(self, v, s):
        """Voltage [V] of a steady current."""
        ke = self.kt if self.ke is None else self.ke
        return self.resistance * s["current"] + ke * self.ratio * v

    def voltage_at(self, v: ScalarLike, s: States, t: ScalarLike) -> Scalar:
        """Voltage at the winding [V], within the limits of the drive."""
        voltage = number(self.voltage(t))
        if self.max_torque is not None:
            most, drop = self.max_torque / jnp.abs(self.kt), self._drop(v, s)
            per_current = self.inductance / self.limit_time
            lowest, highest = (drop + per_current * (limit - s["current"]) for limit in (-most, most))
            voltage = jnp.clip(voltage, lowest, highest)
        return voltage if self.max_voltage is None else jnp.clip(voltage, -self.max_voltage, self.max_voltage)

    def effort(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> Scalar:  # type: ignore[override]
        """Torque at the joint [N m or N]."""
        return self.ratio * self.kt * s["current"]

    def potential(self, x: ScalarLike, s: States, t: ScalarLike) -> Scalar:  # type: ignore[override]
        """Energy of the winding's field [J]."""
        return self.inductance / 2.0 * jnp.square(s["current"])

    def bonds(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> ElementBonds:
        """Voltage, resistance and inductance at the current, a gyrator to the joint; where `ke` is not `kt`, what its
        gap loses."""
        i, turning = s["current"], self.ratio * v
        bonds = {
            "Se:voltage -> 1:current": electric(self.voltage_at(v, s, t), i),
            "1:current -> R:resistance": electric(self.resistance * i, i),
            "1:current -> I:inductance": electric(self.inductance * self.rate(x, v, s, t)["current"], i),
            "1:current -> GY:air gap": electric(self.kt * turning, i),
            "GY:air gap -> 1:port": ElementBond(self.ratio * self.kt * i, v),
        }
        if self.ke is None:
            return bonds
        return bonds | {"1:current -> R:air gap": electric((self.ke - self.kt) * turning, i)}

    def faults(self) -> list[str]:
        """Signs of what it is made of."""
        return super().faults() + faults_if(
            (negative(self.resistance), "resistance must not be negative"),
            (not_positive(self.inductance), "inductance must be positive"),
            (not_positive(self.limit_time), "limit_time must be positive"),
            (self.max_voltage is not None and not_positive(self.max_voltage), "max_voltage must be positive"),
            (self.max_torque is not None and not_positive(self.max_torque), "max_torque must be positive"),
        )
