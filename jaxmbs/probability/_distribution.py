"""`AbstractDistribution`: a random number as a function of a standard normal one."""

import dataclasses
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import log_ndtr, ndtr
from jax.scipy.stats import norm
from jaxtyping import Array

from ..checks import any_concrete
from ..errors import ModelError
from ..forces._fields import number
from ..tables import fields_repr
from ..typing import ArrayLike


class AbstractDistribution(eqx.Module):
    """A random number x, by the increasing function x(u) of a standard normal number u.

    All that reliability needs follows from that function: it is right in both tails, where a cumulative probability
    near one has lost its digits.  The parameters of a distribution are leaves.
    """

    #: The number that polynomials of this one are of: "normal", or "uniform" where it is linear in the probability.
    germ: ClassVar[str] = "normal"
    #: True if its function may have steps, which integrals over it need many points for.
    has_gaps: ClassVar[bool] = False

    __repr__ = fields_repr

    def from_normal(self, u: ArrayLike) -> Array:
        """The number x (...) whose cumulative probability is that of the standard normal number u (...)."""
        raise NotImplementedError

    def to_normal(self, x: ArrayLike) -> Array:
        """The standard normal number u (...) of x (...), the inverse of `from_normal`."""
        raise NotImplementedError

    def moments(self) -> tuple[Array, Array]:
        """(mean, standard deviation)."""
        raise NotImplementedError

    def with_moments(self, mean: Any, deviation: Any) -> "AbstractDistribution":
        """The distribution of the same family with this mean and standard deviation."""
        raise NotImplementedError

    def cumulative(self, x: ArrayLike) -> Array:
        """Probability (...) of numbers below x (...)."""
        return ndtr(self.to_normal(x))

    def density(self, x: ArrayLike) -> Array:
        """Probability density (...) at x (...)."""
        u = self.to_normal(x)
        slope = jax.jvp(self.from_normal, (u,), (jnp.ones_like(u),))[1]
        return jnp.where(slope > 0.0, norm.pdf(u) / jnp.where(slope > 0.0, slope, 1.0), 0.0)

    @property
    def parameters(self) -> dict[str, Array]:
        """The parameters by name, those that are single numbers."""
        fields = [(f.name, getattr(self, f.name)) for f in dataclasses.fields(self)]
        return {
            name: jnp.asarray(value)
            for name, value in fields
            if isinstance(value, Array | np.ndarray) and value.ndim == 0
        }


def log_cumulative(u: Array) -> Array:
    """Logarithm of the probability of standard normal numbers below u (...).

    JAX's `log_ndtr` takes the logarithm of a number near one between 0 and 8: at 7.5 two digits are left.
    """
    is_high = u > 0.0  # no maximum of u and 0, whose derivative at 0 is a half
    return jnp.where(is_high, jnp.log1p(-ndtr(-jnp.where(is_high, u, 0.0))), log_ndtr(jnp.where(is_high, 0.0, u)))


def parameter() -> Any:
    """A field of a distribution: one real number."""
    return eqx.field(converter=number)


def check_parameters(distribution: AbstractDistribution, *positive: str) -> None:
    """Raises: ModelError for parameters that are no single finite number, and those named that are not positive."""
    faults = []
    for field in dataclasses.fields(distribution):
        value = getattr(distribution, field.name)
        if not isinstance(value, Array | np.ndarray):
            continue
        if value.ndim:
            faults.append(f"{field.name} must be one number, not an array of shape {value.shape}")
        elif any_concrete(lambda x: ~np.isfinite(x), value):
            faults.append(f"{field.name} must be finite, it is {value}")
        elif field.name in positive and any_concrete(lambda x: ~(x > 0.0), value):
            faults.append(f"{field.name} must be positive, it is {value}")
    if faults:
        raise ModelError(faults, f"the distribution {type(distribution).__name__}")


def check_order(distribution: AbstractDistribution, *names: str) -> None:
    """Raises: ModelError for parameters that are not in ascending order."""
    values = [getattr(distribution, name) for name in names]
    if any_concrete(lambda *x: np.any(np.diff(x) < 0.0) | (x[-1] <= x[0]), *values):
        text = ", ".join(f"{name} = {value}" for name, value in zip(names, values, strict=True))
        raise ModelError([f"{text}: they must ascend"], f"the distribution {type(distribution).__name__}")
