"""A valve that opens at a pressure."""

import equinox as eqx

from ..checks import faults_if, negative, not_positive
from ..forces._fields import number
from ..math._signed_root import smooth_ramp
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractTwoPort


class ReliefValve(AbstractTwoPort):
    """Relief valve from a to b: `Q = slope (p_a - p_b - cracking)` above the cracking pressure, closed below.

    Attributes:
        cracking: pressure difference at which it begins to open, >= 0 [Pa].
        slope: flow over the pressure above it, > 0 [m^3/s/Pa].
        rounding: pressure on both sides of the cracking pressure in which the slope grows, > 0 [Pa].
    """

    cracking: Convertible[Scalar] = eqx.field(converter=number)
    slope: Convertible[Scalar] = eqx.field(converter=number)
    rounding: Convertible[Scalar] = eqx.field(converter=number, default=1e4)

    def flow(self, drop: ScalarLike, signal: None = None) -> Scalar:
        """Flow from a to b [m^3/s]."""
        return self.slope * smooth_ramp(drop - self.cracking, self.rounding)

    def faults(self) -> list[str]:
        """Signs of its numbers."""
        return super().faults() + faults_if(
            (negative(self.cracking), "cracking must not be negative"),
            (not_positive(self.slope), "slope must be positive"),
            (not_positive(self.rounding), "rounding must be positive"),
        )
