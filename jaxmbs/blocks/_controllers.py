"""Controllers of a measured signal: proportional, integral and derivative parts, with limits."""

from collections.abc import Callable
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..checks import any_concrete, faults_if, may_be_nonzero, negative, not_positive
from ..forces._fields import number, optional_number
from ..forces._internal_state import InternalState, States
from ..forces._signals import as_signal
from ..typing import ArrayLike, Convertible, Scalar, ScalarLike
from ._base import AbstractBlock


def bounds(limit: Array) -> tuple[Array, Array]:
    """Lower and upper limit of one number, the same on both sides, or two."""
    return (-limit, limit) if limit.ndim == 0 else (limit[0], limit[1])


def clip(value: Array, lower: Array, upper: Array) -> Array:
    """The value between two limits."""
    return jnp.where(value < lower, lower, jnp.where(value > upper, upper, value))


def limit_faults(limit) -> list[str]:
    """Faults of a limit of one or two numbers."""
    if limit is None:
        return []
    if limit.shape not in ((), (2,)):
        return [f"limit must be one number or (lower, upper), got shape {limit.shape}"]
    wrong = any_concrete(lambda x: x <= 0 if x.ndim == 0 else x[0] >= x[1], limit)
    return faults_if((wrong, "limit must be positive, or (lower, upper) with lower < upper"))


class PI(AbstractBlock):
    """Controller `y = kp e + integral`, `d integral/dt = ki e` of the error `e = target - u`.

    With a limit the output is clipped, and the integral follows what was cut off, `d integral/dt = ki e + (y - v)/T`
    with v before clipping and the tracking time T (back-calculation), so that it does not wind up.

    Attributes:
        kp, ki: gains >= 0 of the error and of its integral [1/s].
        target: function of time or a number, in the unit of u.
        limit: of the output, one number for both sides or (lower, upper); default none.
        tracking: T > 0 [s]; default kp / ki.
    """

    kp: Convertible[Scalar] = eqx.field(converter=number)
    ki: Convertible[Scalar] = eqx.field(converter=number)
    target: Convertible[Callable[..., Any]] = eqx.field(converter=as_signal, default=0.0)
    limit: Convertible[Float[Array, "..."] | None] = eqx.field(converter=optional_number, default=None)
    tracking: Convertible[Scalar | None] = eqx.field(converter=optional_number, default=None)
    inputs: ClassVar[tuple[str, ...]] = ("target",)

    @property
    def internal_states(self) -> dict[str, InternalState]:
        return {"integral": InternalState()}

    def rate(self, u: Float[Array, "..."], s: States, t: ScalarLike) -> States:
        """Rate of the integral."""
        e = number(self.target(t)) - u
        return {"integral": self.ki * e + self._back_calculation(self._unlimited(e, s))}

    def output(self, u: Float[Array, "..."], s: States, t: ScalarLike) -> Float[Array, "..."]:
        """The clipped output."""
        v = self._unlimited(number(self.target(t)) - u, s)
        return v if self.limit is None else clip(v, *bounds(self.limit))

    def sample(
        self, u: Float[Array, "..."], s: States, t: ScalarLike, period: ScalarLike
    ) -> tuple[Float[Array, "..."], States]:
        """Output, and the integral after a period of this error; what was cut off is followed in the tracking time,
        or in one period if that is longer."""
        e = number(self.target(t)) - u
        return self._of_samples(self.kp * e + s["integral"], e, s, period)

    def _of_samples(self, v, e, s, period):
        integral = s["integral"] + period * self.ki * e
        if self.limit is None:
            return v, {"integral": integral}
        y, rate = clip(v, *bounds(self.limit)), self.ki / self.kp if self.tracking is None else 1.0 / self.tracking
        return y, {"integral": integral + jnp.minimum(period * rate, 1.0) * (y - v)}

    def _unlimited(self, e, s):
        return self.kp * e + s["integral"]

    def _back_calculation(self, v):
        if self.limit is None:
            return 0.0
        cut = clip(v, *bounds(self.limit)) - v
        return cut * self.ki / self.kp if self.tracking is None else cut / self.tracking

    def faults(self) -> list[str]:
        """Signs of the gains and the limit."""
        no_time = self.limit is not None and self.tracking is None and not may_be_nonzero(self.kp)
        return (
            super().faults()
            + limit_faults(self.limit)
            + faults_if(
                (negative(self.kp), "kp must not be negative: exchange the sign of the signal or of what it drives"),
                (negative(self.ki), "ki must not be negative: exchange the sign of the signal or of what it drives"),
                (self.tracking is not None and not_positive(self.tracking), "tracking must be positive"),
                (no_time, "with kp = 0 and a limit, give the tracking time"),
            )
        )


class PID(PI):
    """Controller `y = kp e + integral + kd d`, with the derivative d of the error `e = target - u` through a filter
    of the first order: `d = (e - filtered) / filter`, `d filtered/dt = d`.

    The filter starts at the error, so that there is no kick. Limit and tracking are those of `PI`.  All but `kp` and
    `ki` are given by name: the third of a PID is read as kd by some and as the target by others.

    Attributes:
        kp, ki, target, limit, tracking: as of `PI`.
        kd: gain >= 0 of the derivative [s].
        filter: time constant > 0 [s] of the derivative.
    """

    kd: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    filter: Convertible[Scalar] = eqx.field(converter=number, default=0.01)

    def __init__(
        self,
        kp: ScalarLike,
        ki: ScalarLike,
        *others: Any,
        target: Any = 0.0,
        limit: ArrayLike | None = None,
        tracking: ScalarLike | None = None,
        kd: ScalarLike = 0.0,
        filter: ScalarLike = 0.01,
    ) -> None:
        if others:
            raise TypeError("PID takes kp and ki by place, the rest by name: PID(kp, ki, kd=..., target=...)")
        self.kp, self.ki, self.target, self.limit = number(kp), number(ki), as_signal(target), optional_number(limit)
        self.tracking, self.kd, self.filter = optional_number(tracking), number(kd), number(filter)

    @property
    def internal_states(self) -> dict[str, InternalState]:
        return {"integral": InternalState(), "filtered": InternalState()}

    def start(self, u: Float[Array, "..."], t: ScalarLike) -> States:
        """The filter at the error."""
        return {"filtered": number(self.target(t)) - u}

    def rate(self, u: Float[Array, "..."], s: States, t: ScalarLike) -> States:
        """Rates of the integral and of the filter."""
        e = number(self.target(t)) - u
        return super().rate(u, s, t) | {"filtered": (e - s["filtered"]) / self.filter}

    def sample(
        self, u: Float[Array, "..."], s: States, t: ScalarLike, period: ScalarLike
    ) -> tuple[Float[Array, "..."], States]:
        """As of `PI`, with the derivative by the backward difference, which no period makes large:
        `d = (e - filtered) / (filter + period)`."""
        e = number(self.target(t)) - u
        d = (e - s["filtered"]) / (self.filter + period)
        y, found = self._of_samples(self.kp * e + s["integral"] + self.kd * d, e, s, period)
        return y, found | {"filtered": s["filtered"] + period * d}

    def _unlimited(self, e, s):
        return super()._unlimited(e, s) + self.kd * (e - s["filtered"]) / self.filter

    def faults(self) -> list[str]:
        """Signs of the gains and the limit."""
        return super().faults() + faults_if(
            (negative(self.kd), "kd must not be negative: exchange the sign of the signal or of what it drives"),
            (not_positive(self.filter), "filter, the time constant of the derivative, must be positive"),
        )
