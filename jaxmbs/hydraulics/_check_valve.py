"""A valve of one direction."""

import equinox as eqx

from ..checks import faults_if, negative, not_positive
from ..forces._fields import number
from ..math._signed_root import signed_root, smooth_ramp
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractTwoPort


class CheckValve(AbstractTwoPort):
    """Check valve from a to b: `Q = rated_flow sqrt((p_a - p_b - cracking) / rated_drop)`, nothing from b to a.

    Attributes:
        rated_flow: at the rated pressure difference above the cracking pressure, > 0 [m^3/s].
        rated_drop: > 0 [Pa].
        cracking: pressure difference at which it begins to open, >= 0 [Pa].
        laminar: pressure difference below which the flow is laminar, and on both sides of the cracking pressure in
            which the valve opens, > 0 [Pa].
    """

    rated_flow: Convertible[Scalar] = eqx.field(converter=number)
    rated_drop: Convertible[Scalar] = eqx.field(converter=number)
    cracking: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    laminar: Convertible[Scalar] = eqx.field(converter=number, default=1e4)

    def flow(self, drop: ScalarLike, signal: None = None) -> Scalar:
        """Flow from a to b [m^3/s]."""
        above = smooth_ramp(drop - self.cracking, self.laminar)
        return self.rated_flow * signed_root(above, self.laminar) / signed_root(self.rated_drop, self.laminar)

    def faults(self) -> list[str]:
        """Signs of its numbers."""
        return super().faults() + faults_if(
            (not_positive(self.rated_flow), "rated_flow must be positive"),
            (not_positive(self.rated_drop), "rated_drop must be positive"),
            (negative(self.cracking), "cracking must not be negative"),
            (not_positive(self.laminar), "laminar must be positive"),
        )
