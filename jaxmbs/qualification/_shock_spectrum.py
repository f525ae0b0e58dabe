"""Shock response spectrum: greatest responses of oscillators on a base with a given acceleration."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..checks import any_concrete, not_positive
from ..fatigue._arrays import float_array
from ..math._extremes import largest, least
from ..quantities import Axis, Quantity
from ..reports import Report, Reported
from ..runtime import as_dtype, jit
from ..typing import ArrayLike
from ..vibration._oscillator_motion import Oscillators
from ..vibration._oscillator_peaks import peaks

KINDS = ("absolute acceleration", "relative displacement", "pseudo velocity")
_UNITS = dict(zip(KINDS, ("m/s^2", "m", "m/s"), strict=True))


class ShockSpectrum(Reported, eqx.Module):
    """Shock response spectrum of one signal.

    Attributes:
        frequencies: (f,) natural frequencies [Hz].
        during: (2, f), greatest and least response while the signal lasts (primary), zero among them.
        after: (2, f), the same from the last sample on (residual).
        kind: of the response.
    """

    frequencies: Float[Array, " f"]
    during: Float[Array, "2 f"]
    after: Float[Array, "2 f"]
    kind: str = eqx.field(static=True)

    def report(self) -> Report:
        frequency, unit = (Axis("frequency", np.asarray(self.frequencies), "Hz"),), _UNITS[self.kind]
        names = ("maximax", "primary", "residual", "positive", "negative")
        found = [Quantity(name, getattr(self, name), unit, frequency) for name in names]
        return Report(found, f"{self.kind}, {len(self.frequencies)} frequencies")

    @property
    def primary(self) -> Float[Array, " f"]:
        """Greatest magnitude while the signal lasts."""
        return largest(jnp.abs(self.during), 0)

    @property
    def residual(self) -> Float[Array, " f"]:
        """Greatest magnitude after the signal."""
        return largest(jnp.abs(self.after), 0)

    @property
    def maximax(self) -> Float[Array, " f"]:
        """Greatest magnitude at any time."""
        return jnp.maximum(self.primary, self.residual)

    @property
    def positive(self) -> Float[Array, " f"]:
        """Greatest response at any time."""
        return jnp.maximum(self.during[0], self.after[0])

    @property
    def negative(self) -> Float[Array, " f"]:
        """Least response at any time, as a positive number."""
        return -jnp.minimum(self.during[1], self.after[1])


def shock_spectrum(
    signal: ArrayLike, step: ArrayLike, frequencies: ArrayLike, Q: ArrayLike = 10.0, kind: str = KINDS[0]
) -> ShockSpectrum:
    """Shock response spectrum of a base acceleration.

    Between samples the acceleration is straight, and the motion of the oscillators exact for that (ramp-invariant:
    Smallwood 1981, ISO 18431-4); peaks are those of that motion, between the samples too, to 1e-7 of themselves.
    Oscillators are at rest until the first sample: if it is not zero, the acceleration begins with a jump there.
    After the last sample the base moves on without acceleration, if need be with a jump: that time has no end.

    Args:
        signal: (samples,) [m/s^2, or g], from rest.
        step: time between samples [s], > 0, half of the shortest period or less; that the record is straight between
            samples is the user's assumption.
        frequencies: (f,) natural frequencies [Hz], > 0, or one.
        Q: amplification at resonance, > 0.5: the damping ratio is `1 / (2 Q)`; infinite for none.
        kind: "absolute acceleration" in the signal's unit, "relative displacement" [m for m/s^2], "pseudo velocity",
            the displacement times `2 pi f`.

    Derivatives are those of the peaks in the steps where they are.

    Raises: ValueError for another kind and, if concrete, numbers out of range and steps longer than half a period.
    """
    signal, frequencies = float_array(signal), jnp.atleast_1d(float_array(frequencies))
    _check(signal, step, frequencies, Q, kind)
    f = as_dtype(frequencies, signal.dtype)
    during, after = _extremes(signal, as_dtype(step, signal.dtype), f, as_dtype(Q, signal.dtype), kind)
    return ShockSpectrum(f, during, after, kind)


def _check(signal, step, frequencies, Q, kind):
    if kind not in KINDS:
        raise ValueError(f"kind = {kind!r} must be one of {', '.join(map(repr, KINDS))}")
    if signal.ndim != 1 or len(signal) < 2 or any_concrete(lambda x: ~np.isfinite(x), signal):
        raise ValueError(f"the signal has shape {signal.shape}: one row of two or more finite samples is needed")
    if not_positive(step) or not_positive(frequencies) or frequencies.ndim != 1:
        raise ValueError("step and frequencies must be positive, frequencies a row")
    if any_concrete(lambda q: ~(q > 0.5), Q):
        raise ValueError(f"Q = {Q} must be above 0.5: the damping ratio is 1 / (2 Q)")
    if any_concrete(lambda f, h: f * h > 0.5, frequencies, step):
        raise ValueError("step is longer than half a period of an oscillator: frequencies are in Hz, the step in s")


@jit
def _extremes(signal, step, f, Q, kind):
    w, rate = 2 * jnp.pi * f, 2 * jnp.pi * f / Q
    # the relative displacement z has z'' + rate z' + w^2 z = -a, the acceleration w^2 a + rate (da/dt)
    if kind == KINDS[0]:
        gains = w**2, rate
    else:
        gains = -(w if kind == KINDS[2] else jnp.ones_like(w)), jnp.zeros_like(w)
    during, end = peaks(signal, step, Oscillators(w**2, rate, *gains))
    return during, _free_extremes(*end, w, rate)


def _free_extremes(y, dy, w, rate):
    """Greatest and least value of a damped sinusoid from its state on: at once, or at its first two extremes."""
    decay = 0.5 * rate
    wd = jnp.sqrt(w**2 - decay**2)
    a, b = y, (dy + decay * y) / wd
    angle = lax.stop_gradient(jnp.arctan2(b * wd - decay * a, a * wd + decay * b) % jnp.pi)
    values = [y]
    for t in (angle, angle + jnp.pi):
        values.append(jnp.exp(-decay / wd * t) * (a * jnp.cos(t) + b * jnp.sin(t)))
    values = jnp.stack(values)
    return jnp.stack([largest(values, 0), least(values, 0)])
