"""An electric motor with the current of its winding."""

from collections.abc import Callable
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp

from ..checks import faults_if, negative, not_positive
from ..typing import Convertible, Scalar, ScalarLike
from ._fields import number, optional_number
from ._signals import as_signal
from ._state_laws import AbstractScalarStateLaw, InternalState, States


class Motor(AbstractScalarStateLaw):
    """Direct-current motor, or a synchronous one by its torque-making current, behind a gear of some ratio.

    `inductance di/dt = voltage - resistance i - ke ratio v` and `effort = ratio kt i`: a gyrator between voltage and
    current on one side, speed and torque on the other. Its electric power counts as input. The inertia of its rotor
    is that of a body, which turns with the joint, or by a `Coupler` for the gear.

    Attributes:
        voltage: function of time or a number [V].
        resistance: >= 0 [ohm].
        inductance: > 0 [H].
        kt: torque constant [N m/A], of a linear motor [N/A].
        ke: voltage constant [V s/rad or V s/m]; default kt, as of a motor without losses in its gap.
        ratio: turns of the motor for one of the joint.
    """

    voltage: Convertible[Callable[..., Any]] = eqx.field(converter=as_signal)
    resistance: Convertible[Scalar] = eqx.field(converter=number)
    inductance: Convertible[Scalar] = eqx.field(converter=number)
    kt: Convertible[Scalar] = eqx.field(converter=number)
    ke: Convertible[Scalar | None] = eqx.field(converter=optional_number, default=None)
    ratio: Convertible[Scalar] = eqx.field(converter=number, default=1.0)
    is_source: ClassVar[bool] = True
    inputs: ClassVar[tuple[str, ...]] = ("voltage",)

    @property
    def internal_states(self) -> dict[str, InternalState]:
        return {"current": InternalState(unit="A")}

    def rate(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> States:
        """Rate of the current [A/s]."""
        ke = self.kt if self.ke is None else self.ke
        drop = self.resistance * s["current"] + ke * self.ratio * v
        return {"current": (number(self.voltage(t)) - drop) / self.inductance}

    def effort(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> Scalar:
        """Torque at the joint [N m or N]."""
        return self.ratio * self.kt * s["current"]

    def potential(self, x: ScalarLike, s: States, t: ScalarLike) -> Scalar:
        """Energy of the winding's field [J]."""
        return self.inductance / 2.0 * jnp.square(s["current"])

    def dissipated(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> Scalar:
        """Heat of the winding [W]."""
        return self.resistance * jnp.square(s["current"])

    def faults(self) -> list[str]:
        """Signs of what it is made of."""
        return super().faults() + faults_if(
            (negative(self.resistance), "resistance must not be negative"),
            (not_positive(self.inductance), "inductance must be positive"),
        )
