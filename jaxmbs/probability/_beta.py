"""The beta distribution, with derivatives by its parameters too, which JAX's incomplete beta function has not."""

import functools
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array, lax
from jax.nn import log_sigmoid, sigmoid
from jax.scipy.special import gammaln, ndtri

from ..checks import any_concrete
from ..errors import ModelError
from ..math._newton import newton_root
from ..runtime import as_array
from ..typing import ArrayLike, Convertible, Scalar
from ._distribution import AbstractDistribution, check_order, check_parameters, log_cumulative, parameter


class Beta(AbstractDistribution):
    """Beta distribution of a mean and a standard deviation > 0 between a lower and an upper end."""

    mean: Convertible[Scalar] = parameter()
    deviation: Convertible[Scalar] = parameter()
    lower: Convertible[Scalar] = parameter()
    upper: Convertible[Scalar] = parameter()

    def __check_init__(self):
        check_parameters(self, "deviation")
        check_order(self, "lower", "mean", "upper")
        largest = lambda m, s, a, b: ~(s**2 < (m - a) * (b - m))
        if any_concrete(largest, self.mean, self.deviation, self.lower, self.upper):
            text = f"a deviation of {self.deviation} is more than numbers between these ends with this mean can have"
            raise ModelError([text], "the distribution Beta")

    def exponents(self) -> tuple[Array, Array]:
        """a and b of the density `x^(a-1) (1-x)^(b-1)` of the number between zero and one."""
        width = self.upper - self.lower
        m, s = (self.mean - self.lower) / width, self.deviation / width
        total = m * (1.0 - m) / s**2 - 1.0
        return m * total, (1.0 - m) * total

    def from_normal(self, u: ArrayLike) -> Array:
        u = as_array(u)
        a, b = self.exponents()
        logit = jnp.vectorize(_logit, excluded=(1, 2))(u, a, b)
        return self.lower + (self.upper - self.lower) * sigmoid(logit)

    def to_normal(self, x: ArrayLike) -> Array:
        share = (as_array(x) - self.lower) / (self.upper - self.lower)
        logit = jnp.log(share) - jnp.log1p(-share)
        low, high = jnp.vectorize(_log_tails, excluded=(1, 2), signature="()->(),()")(logit, *self.exponents())
        return jnp.where(low < high, ndtri(jnp.exp(low)), -ndtri(jnp.exp(high)))

    def moments(self) -> tuple[Array, Array]:
        return self.mean, self.deviation

    def with_moments(self, mean: Any, deviation: Any) -> AbstractDistribution:
        return Beta(mean, deviation, self.lower, self.upper)


class _Quantile(eqx.Module):
    """Residual (1,) of the logit of a number: logarithm of its lesser tail less that of the normal number's."""

    u: Array
    a: Array
    b: Array

    def __call__(self, logit):
        low, high = _log_tails(logit[0], self.a, self.b)
        # negative for both where the logit is too small
        return jnp.where(self.u < 0.0, low - log_cumulative(self.u), log_cumulative(-self.u) - high)[None]


def _logit(u, a, b):
    """Logit () of the number with a normal number's cumulative probability.

    The logarithm of either tail is concave in the logit, so that Newton's steps come to the root from one side.
    """
    start = lax.stop_gradient(jnp.log(a) - jnp.log(b))[None]
    return newton_root(_Quantile(u, a, b), start, jnp.ones(1), None, 1e-13, 100, 1e-14)[0][0]


def _log_tails(logit, a, b):
    """Logarithms of the probabilities below and above a number, by its logit."""
    x, y = log_sigmoid(logit), log_sigmoid(-logit)
    whole = gammaln(a) + gammaln(b) - gammaln(a + b)  # JAX's `betaln` is right to six digits for a = 0.3, b = 8
    return _log_tail(x, y, a, b) - whole, _log_tail(y, x, b, a) - whole


def _log_tail(log_x, log_y, a, b):
    """Logarithm of the integral of `t^(a-1) (1-t)^(b-1)` from 0 to x = 1 - y, by t = x s with s between 0 and 1."""
    log_s, rest, log_weight = (jnp.asarray(x, log_x.dtype) for x in _double_exponential())
    log_rest = jnp.log(jnp.exp(log_y) + jnp.exp(log_x) * rest)  # of 1 - x s, right where x s is near one
    terms = a * log_x + (a - 1.0) * log_s + (b - 1.0) * log_rest + log_weight
    largest = lax.stop_gradient(jnp.max(terms))
    return largest + jnp.log(jnp.sum(jnp.exp(terms - largest)))


@functools.cache
def _double_exponential():
    """Logarithms of nodes s between 0 and 1, 1 - s, and logarithms of weights of the tanh-sinh rule.

    It integrates what is infinite at the ends.  Source: Takahasi and Mori 1974, Double exponential formulas for
    numerical integration.
    """
    t = np.linspace(-5.6, 4.0, 161)
    z = np.pi * np.sinh(t)  # s = 1 / (1 + exp(-z))
    log_s, log_rest = -np.logaddexp(0.0, -z), -np.logaddexp(0.0, z)
    log_weight = np.log((t[1] - t[0]) * np.pi * np.cosh(t)) + log_s + log_rest
    return log_s, np.exp(log_rest), log_weight
