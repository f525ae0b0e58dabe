"""A gas under a piston."""

import equinox as eqx
import jax.numpy as jnp

from ..checks import any_concrete, faults_if, negative, not_positive
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractScalarLaw
from ._element_bonds import ElementBond, ElementBonds, fluid
from ._fields import number
from ._validity import Margin


class AirSpring(AbstractScalarLaw):
    """Gas of a polytropic process under a piston, between points or on a joint: gas spring, air spring, accumulator.

    The column of gas has the height `h = height + x - length`, its pressure is `pressure (height / h)^exponent`, and
    `effort = area (pressure there - ambient)` drives x up. Where the column vanishes the effort is NaN, which ends a
    motion with a status.

    Attributes:
        area: of the piston > 0 [m^2].
        pressure: absolute, at x = `length`, > 0 [Pa].
        height: volume of the gas there over the area, > 0 [m].
        exponent: > 1; 1.4 of fast motions (adiabatic), near 1 of slow ones.
        ambient: pressure on the other side >= 0 [Pa].
        length: x where the gas has its `pressure` [m].
    """

    area: Convertible[Scalar] = eqx.field(converter=number)
    pressure: Convertible[Scalar] = eqx.field(converter=number)
    height: Convertible[Scalar] = eqx.field(converter=number)
    exponent: Convertible[Scalar] = eqx.field(converter=number, default=1.4)
    ambient: Convertible[Scalar] = eqx.field(converter=number, default=101325.0)
    length: Convertible[Scalar] = eqx.field(converter=number, default=0.0)

    def _ratio(self, x):
        """Height of the gas over that at `length`; NaN where there is none."""
        ratio = 1.0 + (x - self.length) / self.height
        return jnp.where(ratio > 0.0, ratio, jnp.nan)

    def effort(self, x: ScalarLike, v: ScalarLike, t: ScalarLike) -> Scalar:
        """Force that drives x up [N]."""
        return self.area * (self.pressure * self._ratio(x) ** -self.exponent - self.ambient)

    def potential(self, x: ScalarLike, t: ScalarLike) -> Scalar:
        """Work that the gas and the ambient have taken up since `length` [J]."""
        n, ratio = self.exponent, self._ratio(x)
        gas = self.pressure * self.height * (ratio ** (1.0 - n) - 1.0) / (n - 1.0)
        return self.area * (gas + self.ambient * (x - self.length))

    def validity(self, x: ScalarLike, v: ScalarLike, t: ScalarLike) -> dict[str, Margin]:
        """Height of the column of gas [m]."""
        return {"height": Margin(self.height + x - self.length, "m", "has no gas left")}

    def bonds(self, x: ScalarLike, v: ScalarLike, t: ScalarLike) -> ElementBonds:
        """Gas on one side of the piston and the ambient on the other, both stores."""
        pressure, flow = self.pressure * self._ratio(x) ** -self.exponent, self.area * v
        return {
            "1:port -> TF:piston": ElementBond(self.area * (self.ambient - pressure), v),
            "TF:piston -> 1:flow": fluid(self.ambient - pressure, flow),
            "1:flow -> C:gas": fluid(-pressure, flow),
            "1:flow -> C:ambient": fluid(self.ambient * jnp.ones_like(pressure), flow),
        }

    def faults(self) -> list[str]:
        """Signs of what it is made of."""
        return super().faults() + faults_if(
            (not_positive(self.area), "area must be positive"),
            (not_positive(self.pressure), "pressure must be positive"),
            (not_positive(self.height), "height must be positive"),
            (any_concrete(lambda n: n <= 1, self.exponent), "exponent must be above 1"),
            (negative(self.ambient), "ambient must not be negative"),
        )
