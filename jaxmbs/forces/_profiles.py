"""Functions of time that machines are driven by: moves with a speed and an acceleration, rises of cams, sweeps."""

import equinox as eqx
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

from ..checks import any_concrete, not_positive
from ..typing import ArrayLike, Convertible, Scalar, ScalarLike
from ._fields import number, optional_number
from ._signals import AbstractSignal

CAM_LAWS = ("cycloidal", "modified sine", "3-4-5", "4-5-6-7")


class Trapezoid(AbstractSignal):
    """From `before` over a `distance` and at rest again, as fast as speed, acceleration and jerk allow.

    Without `jerk` the acceleration jumps and the speed is a trapezoid; with it the acceleration is one (an S-curve of
    seven pieces), which is what a drive with an inertia wants. Moves too short for the speed or the acceleration do
    not reach it.

    Attributes:
        distance: of the move [m or rad], of either sign.
        speed, acceleration, jerk: the most allowed, > 0; no `jerk` for jumps of the acceleration.
        start: when the move begins [s].
        before: value until then.
    """

    distance: Convertible[Scalar] = eqx.field(converter=number)
    speed: Convertible[Scalar] = eqx.field(converter=number)
    acceleration: Convertible[Scalar] = eqx.field(converter=number)
    jerk: Convertible[Scalar | None] = eqx.field(converter=optional_number, default=None)
    start: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    before: Convertible[Scalar] = eqx.field(converter=number, default=0.0)

    def __call__(self, t: ScalarLike) -> Scalar:
        way = jnp.where(self.distance < 0, -1.0, 1.0)
        times, jumps, order = self._jumps()
        since = t - self.start
        # from the beginning of its own piece: powers from that of the move grow and cancel
        piece = jnp.clip(jnp.searchsorted(times, lax.stop_gradient(since), side="right") - 1, 0, len(times) - 2)
        x, v, a, jerk = (values[piece] for values in _piece_starts(times, jumps, order))
        s = jnp.where(since < 0.0, 0.0, since - times[piece])
        moved = x + s * (v + s * (a / 2 + s * jerk / 6))
        return self.before + way * jnp.where(since >= times[-1], way * self.distance, moved)

    @property
    def duration(self) -> Scalar:
        """Time that the move takes [s]."""
        return self._jumps()[0][-1]

    def _jumps(self):
        size = jnp.where(self.distance < 0, -self.distance, self.distance)
        return _acceleration_jumps(size, self) if self.jerk is None else _jerk_jumps(size, self)

    def faults(self) -> list[str]:
        """Speed, acceleration and jerk are positive."""
        limits = {"speed": self.speed, "acceleration": self.acceleration, "jerk": self.jerk}
        wrong = [f"{name} must be positive" for name, x in limits.items() if x is not None and not_positive(x)]
        return super().faults() + wrong


def _piece_starts(times, jumps, order):
    """Place, speed, acceleration and jerk (pieces,) where each piece begins."""
    long = jnp.diff(times)
    level = jnp.cumsum(jumps)[:-1]
    none = jnp.zeros_like(level)

    def at_start(rises):
        return jnp.concatenate([none[:1], jnp.cumsum(rises)[:-1]])

    jerk = level if order == 3 else none
    a = at_start(jerk * long) if order == 3 else level
    v = at_start(long * (a + long * jerk / 2))
    return at_start(long * (v + long * (a / 2 + long * jerk / 6))), v, a, jerk


def _acceleration_jumps(size, move):
    """Times from the start at which the acceleration jumps, the jumps, and the power of time that they give."""
    reaches = size * move.acceleration >= move.speed**2
    rise = jnp.where(reaches, move.speed / move.acceleration, _root(size / move.acceleration, 2, reaches))
    steady = jnp.where(reaches, size / move.speed - rise, 0.0)
    times = jnp.stack([jnp.zeros_like(rise), rise, rise + steady, 2 * rise + steady])
    return times, move.acceleration * jnp.asarray([1.0, -1.0, -1.0, 1.0], times.dtype), 2


def _jerk_jumps(size, move):
    """The same of the jerk: `rise` to the greatest speed and `bend` of each change of the acceleration."""
    speed, most, jerk = move.speed, move.acceleration, move.jerk
    is_long = speed * jerk >= most**2  # the acceleration is reached on the way to the speed
    bend = jnp.where(is_long, most / jerk, _root(speed / jerk, 2, is_long))
    rise = jnp.where(is_long, speed / most + most / jerk, 2 * bend)
    steady = size / speed - rise
    reaches = steady >= 0
    # too short for the speed: with the acceleration, or without
    holds = reaches | (size * jerk**2 >= 2 * most**3)
    half = most / jerk / 2
    short_bend = jnp.where(holds, 2 * half, _root(size / (2 * jerk), 3, holds))
    short_rise = jnp.where(holds, half + _root(half**2 + size / most, 2, reaches), 2 * short_bend)
    bend, rise = jnp.where(reaches, bend, short_bend), jnp.where(reaches, rise, short_rise)
    steady = jnp.where(reaches, steady, 0.0)
    up = jnp.stack([jnp.zeros_like(rise), bend, rise - bend, rise])
    times = jnp.concatenate([up, rise + steady + up])
    return times, jerk * jnp.asarray([1.0, -1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0], times.dtype), 3


def _root(x, order, is_unused):
    """A root whose slope is finite where it is not used and of nothing."""
    ends = is_unused | (x <= 0)
    x = jnp.where(ends, 1.0, x)
    return jnp.where(ends, 0.0, jnp.sqrt(x) if order == 2 else jnp.cbrt(x))


class CamRise(AbstractSignal):
    """A rise of a cam's follower between two dwells, by the time or by the angle that stands for it.

    With s from 0 to 1 over the duration, of a unit rise: "cycloidal" `s - sin(2 pi s) / (2 pi)`; "modified sine" of a
    quarter of its acceleration at each end in an eighth of the duration; "3-4-5" `10 s^3 - 15 s^4 + 6 s^5`; "4-5-6-7"
    `35 s^4 - 84 s^5 + 70 s^6 - 20 s^7`. The largest accelerations are 6.28, 5.53, 5.77 and 7.51 times the rise over
    the duration squared (Norton 2009, Cam Design and Manufacturing Handbook).

    Attributes:
        rise: of the follower [m or rad], of either sign.
        duration: of the rise [s, or rad of the cam], > 0.
        law: of "cycloidal", "modified sine", "3-4-5" and "4-5-6-7".
        start: when it begins.
        before: value until then.
    """

    rise: Convertible[Scalar] = eqx.field(converter=number)
    duration: Convertible[Scalar] = eqx.field(converter=number)
    law: str = eqx.field(static=True, default=CAM_LAWS[0])
    start: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    before: Convertible[Scalar] = eqx.field(converter=number, default=0.0)

    def __check_init__(self) -> None:
        if self.law not in CAM_LAWS:
            raise ValueError(f"law = {self.law!r} must be one of {', '.join(map(repr, CAM_LAWS))}")

    def __call__(self, t: ScalarLike) -> Scalar:
        s = (t - self.start) / self.duration
        s = jnp.where(s < 0, 0.0, jnp.where(s > 1, 1.0, s))
        return self.before + self.rise * _unit_rise(s, self.law)

    def faults(self) -> list[str]:
        """The rise takes time."""
        return super().faults() + (["duration must be positive"] if not_positive(self.duration) else [])


def _unit_rise(s, law):
    if law == "cycloidal":
        return s - jnp.sin(2 * jnp.pi * s) / (2 * jnp.pi)
    if law == "3-4-5":
        return s**3 * (10 - s * (15 - 6 * s))
    if law == "4-5-6-7":
        return s**4 * (35 - s * (84 - s * (70 - 20 * s)))
    ends = jnp.pi * s - jnp.sin(4 * jnp.pi * s) / 4
    middle = 2 + jnp.pi * s - 9 / 4 * jnp.sin((4 * jnp.pi * s + jnp.pi) / 3)
    return jnp.where(s < 1 / 8, ends, jnp.where(s > 7 / 8, 4 + ends, middle)) / (4 + jnp.pi)


class Chirp(AbstractSignal):
    """`mean + amplitude sin(angle)`, the frequency going from one to another while it lasts, and staying there.

    Attributes:
        omega_start, omega_end: circular frequencies [rad/s], > 0 and different if logarithmic.
        duration: of the sweep [s], > 0.
        mean, amplitude: of the value.
        phase: angle at the start [rad].
        start: when the sweep begins [s]; before, the frequency is the first one.
        is_logarithmic: equal times for equal ratios of frequencies, instead of for equal differences.
    """

    omega_start: Convertible[Scalar] = eqx.field(converter=number)
    omega_end: Convertible[Scalar] = eqx.field(converter=number)
    duration: Convertible[Scalar] = eqx.field(converter=number)
    mean: Convertible[Float[Array, "..."]] = eqx.field(converter=number, default=0.0)
    amplitude: Convertible[Float[Array, "..."]] = eqx.field(converter=number, default=1.0)
    phase: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    start: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    is_logarithmic: bool = eqx.field(static=True, default=False)

    def __call__(self, t: ScalarLike) -> Float[Array, "..."]:
        since = t - self.start
        s = jnp.clip(since / self.duration, 0.0, 1.0)
        if self.is_logarithmic:
            decades = jnp.log(self.omega_end / self.omega_start)
            swept = self.omega_start * jnp.expm1(decades * s) / decades
        else:
            swept = self.omega_start * s + (self.omega_end - self.omega_start) * s**2 / 2
        outside = self.omega_start * jnp.minimum(since, 0.0)
        outside = outside + self.omega_end * jnp.maximum(since - self.duration, 0.0)
        return self.mean + self.amplitude * jnp.sin(self.phase + self.duration * swept + outside)

    def faults(self) -> list[str]:
        """The sweep takes time; a logarithmic one has two frequencies of one sign."""
        wrong = ["duration must be positive"] if not_positive(self.duration) else []
        if self.is_logarithmic:
            ratio = any_concrete(lambda a, b: ~((a * b > 0) & (a != b)), self.omega_start, self.omega_end)
            wrong += (
                ["omega_start and omega_end of a logarithmic chirp must differ and have one sign"] if ratio else []
            )
        return super().faults() + wrong


class Multisine(AbstractSignal):
    """`mean + sum_k amplitudes[k] sin(omegas[k] t + phases[k])`.

    Attributes:
        omegas: (n,) circular frequencies [rad/s].
        amplitudes: (n,), or one of all.
        phases: (n,) [rad]; by default those of Schroeder (1970), which keep the peaks of equal amplitudes low.
        mean: of the value.
    """

    omegas: Float[Array, " n"]
    amplitudes: Float[Array, " n"]
    phases: Float[Array, " n"]
    mean: Scalar

    def __init__(
        self,
        omegas: ArrayLike,
        amplitudes: ArrayLike = 1.0,
        phases: ArrayLike | None = None,
        mean: ArrayLike = 0.0,
    ) -> None:
        self.omegas, self.mean = jnp.atleast_1d(number(omegas)), number(mean)
        shape = self.omegas.shape
        self.amplitudes = jnp.broadcast_to(number(amplitudes), shape)
        if phases is None:
            k = jnp.arange(shape[0], dtype=self.omegas.dtype)
            phases = -jnp.pi * k * (k + 1) / shape[0]
        self.phases = jnp.broadcast_to(number(phases), shape)

    def __call__(self, t: ScalarLike) -> Scalar:
        return self.mean + jnp.dot(self.amplitudes, jnp.sin(self.omegas * t + self.phases))
