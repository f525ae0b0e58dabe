"""A pump of a given displacement."""

from typing import Any, ClassVar

import equinox as eqx

from ..checks import faults_if, negative, not_positive
from ..forces._fields import number
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractTwoPort


class Pump(AbstractTwoPort):
    """Pump from a (inlet) to b (outlet): `Q = displacement speed - leakage (p_b - p_a)`; its signal is the speed.

    Attributes:
        displacement: volume per radian of the shaft > 0 [m^3/rad].
        leakage: >= 0 [m^3/s/Pa].
    """

    displacement: Convertible[Scalar] = eqx.field(converter=number)
    leakage: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    signal: ClassVar[str] = "needed"

    def flow(self, drop: ScalarLike, signal: Any = None) -> Scalar:
        """Flow from a to b [m^3/s] at the speed `signal` [rad/s]."""
        return self.displacement * signal + self.leakage * drop

    def torque(self, drop: ScalarLike) -> Scalar:
        """Torque [N m] that turns the shaft, `displacement (p_b - p_a)`; `drop` is p_a - p_b [Pa]."""
        return -self.displacement * drop

    def faults(self) -> list[str]:
        """Signs of its numbers."""
        return super().faults() + faults_if(
            (not_positive(self.displacement), "displacement must be positive"),
            (negative(self.leakage), "leakage must not be negative"),
        )
