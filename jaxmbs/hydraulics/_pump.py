"""A pump or motor of a given displacement, at a given speed or on the shaft of a mechanism."""

from collections.abc import Callable
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..checks import faults_if, negative, not_positive
from ..forces import AbstractScalarLaw
from ..forces._element_bonds import ElementBond, ElementBonds, fluid
from ..forces._fields import number
from ..forces._internal_state import States
from ..forces._signals import as_signal
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractTwoPort


class Pump(AbstractTwoPort):
    """Pump from a (inlet) to b (outlet), or hydraulic motor: `Q = displacement speed - leakage (p_b - p_a)`.

    Its signal is the speed; or it is on a joint, `b.hydraulic(..., shaft="joint")`, which gives the speed and gets
    the torque `displacement (p_a - p_b) - drag speed`: a pump takes power from its joint, a motor, which is the same
    with the higher pressure at a, feeds power in.

    Attributes:
        displacement: volume per radian of the shaft > 0 [m^3/rad].
        leakage: >= 0 [m^3/s/Pa].
        drag: of the shaft >= 0 [N m s/rad].
    """

    displacement: Convertible[Scalar] = eqx.field(converter=number)
    leakage: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    drag: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    signal: ClassVar[str] = "needed"

    def flow(self, drop: ScalarLike, signal: Any = None) -> Scalar:
        """Flow from a to b [m^3/s] at the speed `signal` [rad/s]."""
        return self.displacement * signal + self.leakage * drop

    def torque(self, drop: ScalarLike, speed: ScalarLike = 0.0) -> Scalar:
        """Torque [N m] that turns the shaft, `displacement (p_b - p_a) + drag speed`; `drop` is p_a - p_b [Pa]."""
        return self.drag * speed - self.displacement * drop

    def bonds(self, u: Any, s: States, t: ScalarLike) -> ElementBonds:
        """The shaft drives the flow by a transformer; drag and leakage are resistors."""
        (a, b), speed = self.split(u)
        ideal, leak, rise = self.displacement * speed, self.leakage * (b - a), b - a
        return {
            "Sf:shaft -> 1:shaft": ElementBond(self.torque(a - b, speed), speed),
            "1:shaft -> R:drag": ElementBond(self.drag * speed, speed),
            "1:shaft -> TF:displacement": ElementBond(self.displacement * rise, speed),
            "TF:displacement -> 1:flow": fluid(rise, ideal),
            "0:a -> 1:flow": fluid(a, ideal),
            "1:flow -> 0:b": fluid(b, ideal),
            "0:b -> 1:leakage": fluid(b, leak),
            "1:leakage -> R:leakage": fluid(rise, leak),
            "1:leakage -> 0:a": fluid(a, leak),
            "port:a -> 0:a": fluid(a, ideal - leak),
            "0:b -> port:b": fluid(b, ideal - leak),
        }

    def faults(self) -> list[str]:
        """Signs of its numbers."""
        return super().faults() + faults_if(
            (not_positive(self.displacement), "displacement must be positive"),
            (negative(self.leakage), "leakage must not be negative"),
            (self.drag.shape != (), f"drag is one number, got {self.drag.shape}"),
            (negative(self.drag), "drag must not be negative"),
        )


class PumpOnShaft(AbstractTwoPort):
    """A pump whose speed is that of a joint: its output is its flow and its torque on the joint."""

    pump: Pump
    outputs: ClassVar[int] = 2

    def flow(self, drop: ScalarLike, signal: Any = None) -> Scalar:
        """Flow from a to b [m^3/s] at the speed `signal` [rad/s]."""
        return self.pump.flow(drop, signal)

    def output(self, u: Any, s: States, t: ScalarLike) -> Float[Array, "2"]:
        """Flow from a to b [m^3/s], and torque on the joint [N m]."""
        (a, b), speed = self.split(u)
        return jnp.stack([self.pump.flow(a - b, speed), -self.pump.torque(a - b, speed)])

    def bonds(self, u: Any, s: States, t: ScalarLike) -> ElementBonds:
        """Those of the pump; its shaft is a port to the joint."""
        bonds = self.pump.bonds(u, s, t)
        return {name.replace("Sf:shaft", SHAFT): bond for name, bond in bonds.items()}


#: Port of a pump to the joint that it is on, and of the joint's force element to the pump.
SHAFT = "port:shaft"


class PumpTorque(AbstractScalarLaw):
    """Torque of a pump on its joint, which the circuit gives.

    Attributes:
        torque: function of time [N m].
    """

    torque: Convertible[Callable[..., Any]] = eqx.field(converter=as_signal, default=0.0)
    is_source: ClassVar[bool] = True
    inputs: ClassVar[tuple[str, ...]] = ("torque",)

    def effort(self, x: ScalarLike, v: ScalarLike, t: ScalarLike) -> Scalar:
        """Torque that drives the joint [N m]."""
        return number(self.torque(t))

    def bonds(self, x: ScalarLike, v: ScalarLike, t: ScalarLike) -> ElementBonds:
        """Its power is that of the pump."""
        return {f"{SHAFT} -> 1:port": ElementBond(self.effort(x, v, t), v)}
