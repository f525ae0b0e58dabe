"""Moments of a spectrum that are known by themselves."""

from collections.abc import Sequence

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from ..checks import any_concrete, shape_of
from ..errors import ModelError
from ..forces._fields import number
from ..tables import fields_repr
from ..typing import Convertible

#: Powers of the frequency.
_ORDERS = (0, 1, 2, 4)


class SpectralMoments(eqx.Module):
    """Moments `integral f^n G df` of a one-sided spectrum for n = 0, 1, 2, 4, for `spectral_damage`.

    `jax.vmap(lambda row: spectral_damage(SpectralMoments(row), sn))(response.moments)` is the damage of every output.

    Attributes:
        values: (4,) in the unit of the curve squared, times powers of Hz.

    Raises: ModelError for other numbers.
    """

    values: Convertible[Float[Array, "4"]] = eqx.field(converter=number)

    __repr__ = fields_repr

    def __check_init__(self):
        if shape_of(self.values) != (4,) or any_concrete(lambda x: ~(np.isfinite(x) & (x >= 0.0)), self.values):
            raise ModelError(["values must be four finite numbers that are not negative"], "the moments")

    def moments(self, orders: Sequence[float | int]) -> Float[Array, " orders"]:
        """Those of some orders.  Raises: ValueError for an order that is not among them."""
        unknown = [n for n in orders if n not in _ORDERS]
        if unknown:
            raise ValueError(f"moments of the orders 0, 1, 2, 4 are known, not {unknown}")
        return self.values[np.array([_ORDERS.index(int(n)) for n in orders])]
