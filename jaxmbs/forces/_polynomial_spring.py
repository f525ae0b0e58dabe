"""Springs and dampers whose force is a polynomial of stretch and rate."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import any_concrete, faults_if, may_be_nonzero, negative
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractScalarLaw
from ._fields import number


class PolynomialSpring(AbstractScalarLaw):
    """Spring `k_1 d + k_2 d^2 + ...` beside a damper `c_1 v + c_2 |v| v + c_3 v^3 + ...`, at rest over a range.

    The stretch d is how far x lies above `upper`, or below `lower` with a negative sign, and zero between both.  On a
    joint x is its coordinate, between two points their distance; a positive sum drives x down.

    Attributes:
        stiffness: (n,) coefficients k_1, k_2, ... [N/m^i or N m/rad^i].
        damping: (m,) coefficients c_1, c_2, ... >= 0 [N (s/m)^i or N m (s/rad)^i].
        lower, upper: ends of the range without spring force [m or rad]; equal for an ordinary spring.
    """

    stiffness: Convertible[Float[Array, " n"]] = eqx.field(converter=number)
    damping: Convertible[Float[Array, " m"]] = eqx.field(converter=number, default=(0.0,))
    lower: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    upper: Convertible[Scalar] = eqx.field(converter=number, default=0.0)

    def effort(self, x: ScalarLike, v: ScalarLike, t: ScalarLike) -> Scalar:
        """Minus both sums [N or N m]."""
        d, speed = self._stretch(x), jnp.abs(v)
        return -d * _horner(self.stiffness, d) - v * _horner(self.damping, speed)

    def potential(self, x: ScalarLike, t: ScalarLike) -> Scalar:
        """`k_1 d^2 / 2 + k_2 d^3 / 3 + ...` [J]."""
        d = self._stretch(x)
        return d * d * _horner(self.stiffness / np.arange(2.0, self.stiffness.shape[0] + 2.0), d)

    def _stretch(self, x):
        return jnp.where(x > self.upper, x - self.upper, jnp.where(x < self.lower, x - self.lower, 0.0))

    @property
    def stores(self) -> bool:
        return may_be_nonzero(self.stiffness)

    @property
    def dissipates(self) -> bool:
        return may_be_nonzero(self.damping)

    def faults(self) -> list[str]:
        """Coefficients are rows of numbers, those of the damper not negative; the range has an order."""
        rows = self.stiffness.ndim == self.damping.ndim == 1
        return super().faults() + faults_if(
            (not rows, "stiffness and damping are rows of coefficients, (n,) and (m,)"),
            (negative(self.damping), "damping must not be negative"),
            (any_concrete(lambda low, high: low > high, self.lower, self.upper), "lower must not exceed upper"),
        )


def _horner(coefficients, x):
    """`c_1 + c_2 x + c_3 x^2 + ...`."""
    total = jnp.zeros_like(x * 1.0)
    for k in reversed(range(coefficients.shape[0])):
        total = total * x + coefficients[k]
    return total
