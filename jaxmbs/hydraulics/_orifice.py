"""A sharp-edged opening."""

from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp

from ..checks import any_concrete, faults_if, not_positive
from ..forces._fields import number
from ..math._signed_root import signed_root
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractTwoPort


class Orifice(AbstractTwoPort):
    """Sharp-edged orifice from a to b: `Q = discharge area sqrt(2 (p_a - p_b) / density)`, laminar at small drops.

    A signal, where there is one, is its opening: 1 for the whole area.  Source: Merritt (1967), 3-3.

    Attributes:
        area: > 0 [m^2].
        discharge: coefficient, above 0 and at most 1.
        density: of the oil > 0 [kg/m^3].
        laminar: pressure difference below which the flow is laminar, > 0 [Pa].
    """

    area: Convertible[Scalar] = eqx.field(converter=number)
    discharge: Convertible[Scalar] = eqx.field(converter=number, default=0.7)
    density: Convertible[Scalar] = eqx.field(converter=number, default=870.0)
    laminar: Convertible[Scalar] = eqx.field(converter=number, default=1e4)
    signal: ClassVar[str] = "optional"

    def flow(self, drop: ScalarLike, signal: Any = None) -> Scalar:
        """Flow from a to b [m^3/s]; a negative opening counts as closed."""
        gain = self.discharge * self.area * jnp.sqrt(2.0 / self.density)
        full = gain * signed_root(drop, self.laminar)
        return full if signal is None else full * jnp.maximum(signal, 0.0)

    def faults(self) -> list[str]:
        """Signs of its numbers."""
        return super().faults() + faults_if(
            (not_positive(self.area), "area must be positive"),
            (any_concrete(lambda c: (c <= 0) | (c > 1), self.discharge), "discharge must lie above 0, up to 1"),
            (not_positive(self.density), "density must be positive"),
            (not_positive(self.laminar), "laminar must be positive"),
        )
