"""The distribution of measured numbers."""

import dataclasses
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.special import ndtri
from jaxtyping import Float

from ..checks import any_concrete
from ..errors import ModelError
from ..forces._fields import number
from ..math._interpolation import hermite, pchip_slopes
from ..runtime import as_array
from ..typing import ArrayLike, Convertible
from ._distribution import AbstractDistribution


class Empirical(AbstractDistribution):
    """Distribution of measured numbers: a monotone cubic through the sorted samples at their normal scores.

    The k-th of n samples has the score of the cumulative probability (k - 1/2) / n.  Beyond the first and the last
    one the curve goes on straight, as a normal distribution's tails do: what lies there is not measured.

    Attributes: samples: (n,) at least three numbers, not all equal.

    Source: Hazen 1914, Storage to be provided in impounding reservoirs (plotting positions); Fritsch and Butland
    1984, A method for constructing local monotone piecewise cubic interpolants.
    """

    has_gaps: ClassVar[bool] = True

    samples: Convertible[Float[Array, " n"]] = eqx.field(converter=number)

    def __check_init__(self):
        faults = []
        if self.samples.ndim != 1 or len(self.samples) < 3:
            faults.append(f"samples must be at least three numbers in a row, not of shape {self.samples.shape}")
        elif any_concrete(lambda x: ~np.all(np.isfinite(x)) | (np.ptp(x) == 0.0), self.samples):
            faults.append("samples must be finite and not all equal")
        if faults:
            raise ModelError(faults, "the distribution Empirical")

    def _curve(self):
        x = jnp.sort(self.samples)
        scores = ndtri(jnp.asarray((np.arange(len(x)) + 0.5) / len(x), x.dtype))
        return scores, x, pchip_slopes(scores, x)

    def from_normal(self, u: ArrayLike) -> Array:
        scores, x, slopes = self._curve()
        return jnp.vectorize(lambda u: hermite(scores, x, slopes, u))(as_array(u))

    def to_normal(self, x: ArrayLike) -> Array:
        """The normal number, by bisection."""
        x = as_array(x)
        low, high = jnp.full_like(x, -40.0), jnp.full_like(x, 40.0)

        def halve(_, ends):
            middle = 0.5 * (ends[0] + ends[1])
            is_low = self.from_normal(middle) < x
            return jnp.where(is_low, middle, ends[0]), jnp.where(is_low, ends[1], middle)

        return 0.5 * sum(jax.lax.fori_loop(0, 60, halve, (low, high)))

    def moments(self) -> tuple[Array, Array]:
        return jnp.mean(self.samples), jnp.std(self.samples)

    def with_moments(self, mean: Any, deviation: Any) -> AbstractDistribution:
        own, spread = self.moments()
        return dataclasses.replace(self, samples=mean + (self.samples - own) * deviation / spread)
