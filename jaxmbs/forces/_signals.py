"""Functions of time for drives, targets and loads; scalar or vector valued, with parameters as leaves.

Drives need accelerations: `Step` and `Spline` are C2, the others smooth.
"""

import abc
from collections.abc import Callable
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..checks import not_increasing, not_positive
from ..math._interpolation import hermite, spline_slopes
from ..tables import fields_repr
from ..typing import ArrayLike, Convertible, Scalar, ScalarLike
from ._fields import as_function, number, optional_number, value_faults


class AbstractSignal(eqx.Module):
    """A value as a function of time [s]."""

    unbounded: ClassVar[tuple[str, ...]] = ()
    __repr__ = fields_repr

    @abc.abstractmethod
    def __call__(self, t: ScalarLike) -> Float[Array, "..."]:
        """Value at time t."""

    def faults(self) -> list[str]:
        """Faults of the values, one message each; traced values are not checked."""
        return value_faults(self)


class Constant(AbstractSignal):
    """`value` at all times."""

    value: Convertible[Float[Array, "..."]] = eqx.field(converter=number)

    def __call__(self, *args: Any) -> Float[Array, "..."]:
        return self.value


class Ramp(AbstractSignal):
    """`start + rate t`: `start` at t = 0, `rate` per second."""

    start: Convertible[Float[Array, "..."]] = eqx.field(converter=number, default=0.0)
    rate: Convertible[Float[Array, "..."]] = eqx.field(converter=number, default=1.0)

    def __call__(self, t: ScalarLike) -> Float[Array, "..."]:
        return self.start + self.rate * t


class Harmonic(AbstractSignal):
    """`mean + amplitude sin(omega t + phase)`, omega in rad/s, phase in rad."""

    mean: Convertible[Float[Array, "..."]] = eqx.field(converter=number, default=0.0)
    amplitude: Convertible[Float[Array, "..."]] = eqx.field(converter=number, default=1.0)
    omega: Convertible[Float[Array, "..."]] = eqx.field(converter=number, default=1.0)
    phase: Convertible[Float[Array, "..."]] = eqx.field(converter=number, default=0.0)

    def __call__(self, t: ScalarLike) -> Float[Array, "..."]:
        return self.mean + self.amplitude * jnp.sin(self.omega * t + self.phase)


class Polynomial(AbstractSignal):
    """`sum_i coefficients[i] t^i`, lowest power first: (n,), or (n, k) for a vector."""

    coefficients: Convertible[Float[Array, "n ..."]] = eqx.field(converter=number)

    def __call__(self, t: ScalarLike) -> Float[Array, "..."]:
        first = jnp.zeros(self.coefficients.shape[1:], self.coefficients.dtype) * t
        return jax.lax.scan(lambda total, c: (total * t + c, None), first, self.coefficients, reverse=True)[0]


class Step(AbstractSignal):
    """From `before` to `after` within `duration` from `start` [s], by the quintic of zero end rates (C2)."""

    start: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    duration: Convertible[Scalar] = eqx.field(converter=number, default=1.0)
    before: Convertible[Float[Array, "..."]] = eqx.field(converter=number, default=0.0)
    after: Convertible[Float[Array, "..."]] = eqx.field(converter=number, default=1.0)

    def __call__(self, t: ScalarLike) -> Float[Array, "..."]:
        s = (t - self.start) / self.duration
        s = jnp.where(s < 0, 0.0, jnp.where(s > 1, 1.0, s))
        return self.before + (self.after - self.before) * s**3 * (10 - s * (15 - 6 * s))

    def faults(self) -> list[str]:
        """The step takes time."""
        return super().faults() + (["duration must be positive"] if not_positive(self.duration) else [])


class Spline(AbstractSignal):
    """Cubic spline through tabulated values; straight lines before the first and after the last time.

    C2 between the first and last time, and beyond them for the natural spline. The slopes are worked out at
    construction and follow traced `values`; to change a built spline make a new one.

    Attributes:
        times: (n,) increasing [s].
        values: (n,), or (n, k) for a vector.
        slopes: like `values`, rates at the times.
    """

    times: Float[Array, " n"]
    values: Float[Array, "n ..."]
    slopes: Float[Array, "n ..."]

    def __init__(self, times: ArrayLike, values: ArrayLike, end_slopes: ArrayLike | None = None) -> None:
        """`end_slopes`: first and last rate of a clamped spline; None for the natural one."""
        self.times, self.values = number(times), number(values)
        if self.times.ndim != 1 or self.times.shape[0] < 2 or self.values.shape[:1] != self.times.shape:
            raise ValueError(f"need two or more times, as many values: {self.times.shape}, {self.values.shape}")
        self.slopes = spline_slopes(self.times, self.values, optional_number(end_slopes))

    def __call__(self, t: ScalarLike) -> Float[Array, "..."]:
        return hermite(self.times, self.values, self.slopes, t)

    def faults(self) -> list[str]:
        """Times increase, and each has a value and a slope."""
        times, values, slopes = self.times.shape, self.values.shape, self.slopes.shape
        if len(times) != 1 or times[0] < 2 or values[:1] != times or slopes != values:
            return [f"times {times}, values {values} and slopes {slopes} do not go together"]
        return super().faults() + (["times must increase"] if not_increasing(self.times) else [])


class Driven(AbstractSignal):
    """Placeholder of a field that a block drives: a `DrivenValue` takes its place before laws are called."""

    def __repr__(self):
        return "by a block"

    def __call__(self, *args: Any) -> Float[Array, "..."]:
        """Raises: RuntimeError, as the value is not there."""
        raise RuntimeError(
            "a field that a block drives has no value of its own; with_signals(system, at) gives it one"
        )


class DrivenValue(AbstractSignal):
    """`value` whatever the arguments, as a block has found it."""

    value: Float[Array, "..."]

    def __call__(self, *args: Any) -> Float[Array, "..."]:
        """The value."""
        return self.value


class Input(AbstractSignal):
    """A function with a value added, or in its place where `replaces`: an input of a linearisation or a field."""

    function: Any
    value: Float[Array, "..."]
    replaces: Bool[Array, "..."]

    def __call__(self, *args: Any) -> Float[Array, "..."]:
        """The function and the value."""
        return jnp.where(self.replaces, 0.0, number(self.function(*args))) + self.value


def as_signal(value: Any) -> Callable:
    """A function of time from a function, a signal or a constant value."""
    return as_function(value) if callable(value) else Constant(value)


def value_and_rate(signal: Callable, t: Any) -> tuple[Array, Array]:
    """Value and time derivative of a function of time."""
    t = number(t)
    return jax.jvp(lambda s: number(signal(s)), (t,), (jnp.ones_like(t),))
