"""A volume of compressible oil."""

import equinox as eqx
import jax.numpy as jnp

from ..checks import faults_if, not_positive
from ..forces._fields import number
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractStorage


class Volume(AbstractStorage):
    """Node with a volume of oil: `volume / bulk_modulus dp/dt` is the flow into it.

    Attributes:
        volume: > 0 [m^3].
        bulk_modulus: of oil and walls together > 0 [Pa].
        pressure: at the start [Pa].
    """

    volume: Convertible[Scalar] = eqx.field(converter=number)
    bulk_modulus: Convertible[Scalar] = eqx.field(converter=number, default=1.4e9)
    pressure: Convertible[Scalar] = eqx.field(converter=number, default=0.0)

    @property
    def start_pressure(self) -> Scalar:
        """Pressure at the start [Pa]."""
        return self.pressure

    def capacity(self, p: ScalarLike) -> Scalar:
        """`volume / bulk_modulus` [m^3/Pa]."""
        return self.volume / self.bulk_modulus

    def stored(self, p: ScalarLike) -> Scalar:
        """Energy of the compressed oil `V p^2 / (2 E)` [J]."""
        return self.volume * jnp.square(p) / (2.0 * self.bulk_modulus)

    def faults(self) -> list[str]:
        """Signs of its numbers."""
        return super().faults() + faults_if(
            (not_positive(self.volume), "volume must be positive"),
            (not_positive(self.bulk_modulus), "bulk_modulus must be positive"),
        )
