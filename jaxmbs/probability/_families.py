"""Distributions in closed form: normal, lognormal, uniform, Gumbel, Weibull, triangular."""

import math
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array, lax
from jax.scipy.special import gammaln, ndtr, ndtri

from ..errors import ModelError
from ..math._newton import newton_root
from ..runtime import as_array
from ..typing import ArrayLike, Convertible, Scalar
from ._distribution import AbstractDistribution, check_order, check_parameters, log_cumulative, parameter


class Normal(AbstractDistribution):
    """Normal distribution of a mean and a standard deviation > 0."""

    mean: Convertible[Scalar] = parameter()
    deviation: Convertible[Scalar] = parameter()

    def __check_init__(self):
        check_parameters(self, "deviation")

    def from_normal(self, u: ArrayLike) -> Array:
        return self.mean + self.deviation * as_array(u)

    def to_normal(self, x: ArrayLike) -> Array:
        return (as_array(x) - self.mean) / self.deviation

    def moments(self) -> tuple[Array, Array]:
        return self.mean, self.deviation

    def with_moments(self, mean: Any, deviation: Any) -> AbstractDistribution:
        return Normal(mean, deviation)


class LogNormal(AbstractDistribution):
    """Lognormal distribution of a mean > 0 and a standard deviation > 0, of the number itself, not its logarithm."""

    mean: Convertible[Scalar] = parameter()
    deviation: Convertible[Scalar] = parameter()

    def __check_init__(self):
        check_parameters(self, "mean", "deviation")

    def _of_logarithm(self):
        square = jnp.log1p((self.deviation / self.mean) ** 2)
        return jnp.log(self.mean) - 0.5 * square, jnp.sqrt(square)

    def from_normal(self, u: ArrayLike) -> Array:
        mean, deviation = self._of_logarithm()
        return jnp.exp(mean + deviation * as_array(u))

    def to_normal(self, x: ArrayLike) -> Array:
        mean, deviation = self._of_logarithm()
        return (jnp.log(as_array(x)) - mean) / deviation

    def moments(self) -> tuple[Array, Array]:
        return self.mean, self.deviation

    def with_moments(self, mean: Any, deviation: Any) -> AbstractDistribution:
        return LogNormal(mean, deviation)


class Uniform(AbstractDistribution):
    """Uniform distribution between a lower and an upper end."""

    germ = "uniform"

    lower: Convertible[Scalar] = parameter()
    upper: Convertible[Scalar] = parameter()

    def __check_init__(self):
        check_parameters(self)
        check_order(self, "lower", "upper")

    def from_normal(self, u: ArrayLike) -> Array:
        u, width = as_array(u), self.upper - self.lower
        return jnp.where(u < 0.0, self.lower + width * ndtr(u), self.upper - width * ndtr(-u))

    def to_normal(self, x: ArrayLike) -> Array:
        x, width = as_array(x), self.upper - self.lower
        return jnp.where(
            2.0 * x < self.lower + self.upper, ndtri((x - self.lower) / width), -ndtri((self.upper - x) / width)
        )

    def moments(self) -> tuple[Array, Array]:
        return 0.5 * (self.lower + self.upper), (self.upper - self.lower) / math.sqrt(12.0)

    def with_moments(self, mean: Any, deviation: Any) -> AbstractDistribution:
        half = math.sqrt(3.0) * deviation
        return Uniform(mean - half, mean + half)


class Gumbel(AbstractDistribution):
    """Gumbel's distribution of extremes, of a mean and a standard deviation > 0.

    Attributes:
        of: "largest", the type I distribution of the largest of many numbers, such as yearly loads; or "smallest".

    Source: Gumbel, Statistics of Extremes (1958), 5.2.
    """

    mean: Convertible[Scalar] = parameter()
    deviation: Convertible[Scalar] = parameter()
    of: str = eqx.field(static=True, default="largest", kw_only=True)

    def __check_init__(self):
        check_parameters(self, "deviation")
        if self.of not in ("largest", "smallest"):
            raise ModelError([f"of must be 'largest' or 'smallest', not {self.of!r}"], "the distribution Gumbel")

    @property
    def _sign(self):
        return 1.0 if self.of == "largest" else -1.0

    def _scale(self):
        return self.deviation * math.sqrt(6.0) / math.pi

    def from_normal(self, u: ArrayLike) -> Array:
        reduced = -jnp.log(-log_cumulative(self._sign * as_array(u)))
        return self.mean + self._sign * self._scale() * (reduced - np.euler_gamma)

    def to_normal(self, x: ArrayLike) -> Array:
        reduced = np.euler_gamma + self._sign * (as_array(x) - self.mean) / self._scale()
        low, high = ndtri(jnp.exp(-jnp.exp(-reduced))), -ndtri(-jnp.expm1(-jnp.exp(-reduced)))
        return self._sign * jnp.where(reduced < 0.3665, low, high)  # 0.3665: the median

    def moments(self) -> tuple[Array, Array]:
        return self.mean, self.deviation

    def with_moments(self, mean: Any, deviation: Any) -> AbstractDistribution:
        return Gumbel(mean, deviation, of=self.of)


class Weibull(AbstractDistribution):
    """Weibull's distribution `1 - exp(-((x - lower) / scale)^shape)`, with scale > 0 and shape > 0.

    Source: Weibull 1951, A statistical distribution function of wide applicability, (5).
    """

    scale: Convertible[Scalar] = parameter()
    shape: Convertible[Scalar] = parameter()
    lower: Convertible[Scalar] = eqx.field(converter=as_array, default=0.0)

    def __check_init__(self):
        check_parameters(self, "scale", "shape")

    def from_normal(self, u: ArrayLike) -> Array:
        return self.lower + self.scale * (-log_cumulative(-as_array(u))) ** (1.0 / self.shape)

    def to_normal(self, x: ArrayLike) -> Array:
        power = ((as_array(x) - self.lower) / self.scale) ** self.shape
        return jnp.where(power < math.log(2.0), ndtri(-jnp.expm1(-power)), -ndtri(jnp.exp(-power)))

    def moments(self) -> tuple[Array, Array]:
        first, second = (jnp.exp(gammaln(1.0 + k / self.shape)) for k in (1.0, 2.0))
        return self.lower + self.scale * first, self.scale * jnp.sqrt(second - first**2)

    def with_moments(self, mean: Any, deviation: Any) -> AbstractDistribution:
        above = mean - self.lower
        ratio = _ShapeRatio(2.0 * jnp.log(deviation / above))
        start = jnp.log(1.2 * above / deviation)  # of the logarithm of the shape: near enough for all of them
        root, _ = newton_root(ratio, lax.stop_gradient(start)[None], jnp.ones(1), None, 1e-14, 60)
        shape = jnp.exp(root[0])
        return Weibull(above / jnp.exp(gammaln(1.0 + 1.0 / shape)), shape, self.lower)


class _ShapeRatio(eqx.Module):
    """Residual (1,) of the logarithm of Weibull's shape: log of the squared variation less that which is asked."""

    wanted: Array

    def __call__(self, log_shape):
        inverse = jnp.exp(-log_shape[0])
        excess = gammaln(1.0 + 2.0 * inverse) - 2.0 * gammaln(1.0 + inverse)
        return (jnp.log(jnp.expm1(excess)) - self.wanted)[None]


class Triangular(AbstractDistribution):
    """Triangular distribution between a lower and an upper end, most probable at a mode."""

    lower: Convertible[Scalar] = parameter()
    mode: Convertible[Scalar] = parameter()
    upper: Convertible[Scalar] = parameter()

    def __check_init__(self):
        check_parameters(self)
        check_order(self, "lower", "mode", "upper")

    def from_normal(self, u: ArrayLike) -> Array:
        u, width = as_array(u), self.upper - self.lower
        is_low = ndtr(u) * width < self.mode - self.lower
        # the roots of zero have no derivative: where a side is not taken its root is of one
        low = jnp.sqrt(jnp.where(is_low, ndtr(u) * width * (self.mode - self.lower), 1.0))
        high = jnp.sqrt(jnp.where(is_low, 1.0, ndtr(-u) * width * (self.upper - self.mode)))
        return jnp.where(is_low, self.lower + low, self.upper - high)

    def to_normal(self, x: ArrayLike) -> Array:
        x, width = as_array(x), self.upper - self.lower
        is_low = x < self.mode
        sides = jnp.where(is_low, self.mode - self.lower, self.upper - self.mode)
        share = jnp.where(is_low, x - self.lower, self.upper - x) ** 2 / (width * sides)
        return jnp.where(is_low, 1.0, -1.0) * ndtri(share)

    def moments(self) -> tuple[Array, Array]:
        a, c, b = self.lower, self.mode, self.upper
        return (a + b + c) / 3.0, jnp.sqrt(((b - a) ** 2 + (c - a) * (c - b)) / 18.0)

    def with_moments(self, mean: Any, deviation: Any) -> AbstractDistribution:
        own, spread = self.moments()
        return Triangular(*(mean + (x - own) * deviation / spread for x in (self.lower, self.mode, self.upper)))
