"""A vessel of oil and gas."""

import equinox as eqx
import jax.numpy as jnp

from ..checks import any_concrete, faults_if, negative, not_positive
from ..forces._fields import number, optional_number
from ..math._signed_root import smooth_step
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractStorage, integral


class Accumulator(AbstractStorage):
    """Node with a bladder of gas: above the precharge the gas follows `P V^exponent = constant`, P absolute.

    Below the precharge the bladder fills the vessel, and only the oil of `dead_volume` gives way.

    Attributes:
        volume: of the gas at the precharge > 0 [m^3].
        precharge: pressure of the gas without oil >= 0 [Pa].
        exponent: 1 for slow (isothermal) to 1.4 for fast (adiabatic) changes, >= 1.
        pressure: at the start [Pa]; default the precharge.
        ambient: absolute pressure of the atmosphere > 0 [Pa].
        dead_volume: of the oil at the port > 0 [m^3].
        bulk_modulus: of the oil > 0 [Pa].
        rounding: pressure on both sides of the precharge in which the bladder leaves the port, > 0 [Pa].
    """

    volume: Convertible[Scalar] = eqx.field(converter=number)
    precharge: Convertible[Scalar] = eqx.field(converter=number)
    exponent: Convertible[Scalar] = eqx.field(converter=number, default=1.4)
    pressure: Convertible[Scalar | None] = eqx.field(converter=optional_number, default=None)
    ambient: Convertible[Scalar] = eqx.field(converter=number, default=101325.0)
    dead_volume: Convertible[Scalar] = eqx.field(converter=number, default=1e-4)
    bulk_modulus: Convertible[Scalar] = eqx.field(converter=number, default=1.4e9)
    rounding: Convertible[Scalar] = eqx.field(converter=number, default=1e4)

    @property
    def start_pressure(self) -> Scalar:
        """Pressure at the start [Pa]."""
        return self.precharge if self.pressure is None else self.pressure

    def gas_volume(self, p: ScalarLike) -> Scalar:
        """Volume of the gas [m^3] at a pressure [Pa]; below the precharge `volume`."""
        above = jnp.maximum(p, self.precharge) + self.ambient
        return self.volume * ((self.precharge + self.ambient) / above) ** (1.0 / self.exponent)

    def capacity(self, p: ScalarLike) -> Scalar:
        """Of the gas above the precharge, `V / (exponent P)`, and of the oil [m^3/Pa]."""
        above = jnp.maximum(p, self.precharge) + self.ambient
        gas = self.gas_volume(p) / (self.exponent * above) * smooth_step(p - self.precharge, self.rounding)
        return gas + self.dead_volume / self.bulk_modulus

    def stored(self, p: ScalarLike) -> Scalar:
        """Energy of the oil and, above that of the precharge, of the gas [J]; less the work of the atmosphere."""
        p = number(p)
        first, last = self.precharge - self.rounding, self.precharge + self.rounding
        ends = (first, jnp.clip(p, first, self.precharge)), (self.precharge, jnp.clip(p, self.precharge, last))
        opening = [
            integral(lambda q: q * self.capacity(q), low, high) - self._oil(high) + self._oil(low)
            for low, high in ends
        ]
        return opening[0] + opening[1] + self._above(last, jnp.maximum(p, last)) + self._oil(p)

    def _oil(self, p):
        """Energy of the oil [J]."""
        return self.dead_volume / self.bulk_modulus * jnp.square(p) / 2.0

    def _above(self, low, high):
        """Energy [J] that the gas takes from one pressure above the precharge to another."""

        def power_of(y):  # by the logarithm of the absolute pressure, in which all is smooth
            p = jnp.exp(y) - self.ambient
            return p * self.gas_volume(p) / self.exponent

        return integral(power_of, jnp.log(low + self.ambient), jnp.log(high + self.ambient))

    def faults(self) -> list[str]:
        """Signs and ranges of its numbers."""
        return super().faults() + faults_if(
            (not_positive(self.volume), "volume must be positive"),
            (negative(self.precharge), "precharge must not be negative"),
            (any_concrete(lambda n: n < 1, self.exponent), "exponent must be at least 1"),
            (not_positive(self.ambient), "ambient must be positive"),
            (not_positive(self.dead_volume), "dead_volume must be positive"),
            (not_positive(self.bulk_modulus), "bulk_modulus must be positive"),
            (not_positive(self.rounding), "rounding must be positive"),
        )
