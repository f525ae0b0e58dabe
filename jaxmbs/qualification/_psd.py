"""Tables of power spectral density, one-sided over hertz, straight lines between points on log-log paper."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..checks import any_concrete, faults_if, not_increasing, not_positive
from ..errors import ModelError
from ..typing import ArrayLike

#: Standard acceleration of gravity [m/s^2].
STANDARD_GRAVITY = 9.80665
#: Quantity and size in SI units of the units that tables may have.
UNITS = {
    "g^2/Hz": ("acceleration", STANDARD_GRAVITY**2),
    "(m/s^2)^2/Hz": ("acceleration", 1.0),
    "(rad/s^2)^2/Hz": ("acceleration", 1.0),
    "N^2/Hz": ("force", 1.0),
    "(N m)^2/Hz": ("force", 1.0),
    "Pa^2/Hz": ("force", 1.0),
}


class PsdTable(eqx.Module):
    """One-sided power spectral density over frequency, a power law between points; zero outside of the table.

    Attributes:
        frequencies: (points,) [Hz], positive and increasing.
        levels: (points,) in SI units squared per Hz, positive.
        quantity: "acceleration" or "force" (static).
    """

    frequencies: Float[Array, " points"]
    levels: Float[Array, " points"]
    quantity: str = eqx.field(static=True)

    @property
    def mean_square(self) -> Float[Array, ""]:
        """Mean square () in SI units, exact for the power laws between the points."""
        step, rise = jnp.diff(jnp.log(self.frequencies)), jnp.diff(jnp.log(self.levels))
        return jnp.sum(self.levels[:-1] * self.frequencies[:-1] * step * _mean_exponential(rise + step))

    @property
    def rms(self) -> Float[Array, ""]:
        """Root of the mean square () in SI units."""
        return jnp.sqrt(self.mean_square)

    def at(self, frequencies: ArrayLike) -> Array:
        """Levels at any frequencies (...,) [Hz]; zero outside of the table."""
        f = jnp.asarray(frequencies, self.levels.dtype)
        safe = jnp.where(f > 0, f, 1.0)
        found = jnp.exp(jnp.interp(jnp.log(safe), jnp.log(self.frequencies), jnp.log(self.levels)))
        edge = 64 * jnp.finfo(found.dtype).eps  # nodes at an end may round to outside
        low, high = lax.stop_gradient((self.frequencies[0] * (1 - edge), self.frequencies[-1] * (1 + edge)))
        return jnp.where((f >= low) & (f <= high), found, 0.0)

    def scale(self, decibels: ArrayLike) -> "PsdTable":
        """The table raised by decibels, 3 dB doubling it."""
        factor = 10.0 ** (jnp.asarray(decibels, self.levels.dtype) / 10.0)
        return PsdTable(self.frequencies, self.levels * factor, self.quantity)


class WhiteNoise(eqx.Module):
    """White noise: one-sided level () in SI units squared per Hz at all frequencies from zero on.

    Its responses are solutions of a Lyapunov equation, and finite only of outputs that do not follow the input at
    high frequencies.

    Attributes: level: (); quantity: "acceleration" or "force" (static).

    Raises: ModelError for a level that is not positive, and another quantity.
    """

    level: Float[Array, ""]
    quantity: str = eqx.field(static=True)

    def __init__(self, level: ArrayLike, quantity: str = "acceleration") -> None:
        self.level, self.quantity = jnp.asarray(level, float), quantity
        faults = faults_if(
            (not_positive(self.level), f"the level of white noise must be positive, not {level}"),
            (self.level.ndim != 0, f"the level of white noise is one number, not of shape {self.level.shape}"),
            (
                quantity not in ("acceleration", "force"),
                f"quantity = {quantity!r} must be 'acceleration' or 'force'",
            ),
        )
        if faults:
            raise ModelError(faults, "the white noise")


def psd_table(
    frequencies: ArrayLike,
    levels: ArrayLike,
    unit: str = "g^2/Hz",
    *,
    frequency_unit: str = "Hz",
    sides: int = 1,
) -> PsdTable:
    """Power spectral density from a table, straight between its points on log-log paper.

    Args:
        frequencies: (points,), positive and increasing.
        levels: (points,), positive.
        unit: of the levels: "g^2/Hz", "(m/s^2)^2/Hz", "(rad/s^2)^2/Hz", "N^2/Hz", "(N m)^2/Hz" or "Pa^2/Hz".
        frequency_unit: "Hz", or "rad/s": then the levels too are per rad/s and are converted.
        sides: 1, or 2 for levels that negative frequencies share, which are doubled.

    Raises: ModelError with every fault.
    """
    f, S = jnp.asarray(frequencies, float), jnp.asarray(levels, float)
    sizes = f.ndim == 1 and f.shape == S.shape and f.size > 1
    faults = faults_if(
        (not sizes, f"frequencies {f.shape} and levels {S.shape} must be two or more numbers each"),
        (sizes and (not_positive(f) or not_increasing(f)), "frequencies must be positive and increasing"),
        (not_positive(S), "levels must be positive: lines on log-log paper do not reach zero"),
        (any_concrete(lambda x: ~np.isfinite(x), jnp.concatenate([f.ravel(), S.ravel()])), "numbers must be finite"),
        (unit not in UNITS, f"unknown unit {unit!r}: the units are {', '.join(UNITS)}"),
        (frequency_unit not in ("Hz", "rad/s"), f"frequency_unit = {frequency_unit!r} must be 'Hz' or 'rad/s'"),
        (sides not in (1, 2), f"sides = {sides!r} must be 1 or 2"),
    )
    if faults:
        raise ModelError(faults, "the table")
    quantity, size = UNITS[unit]
    per = 2 * np.pi if frequency_unit == "rad/s" else 1.0
    return PsdTable(f / per, S * (size * per * sides), quantity)


def _mean_exponential(x):
    """`(e^x - 1) / x`, one at zero."""
    small = jnp.abs(x) < 1e-3
    safe = jnp.where(small, 1.0, x)
    return jnp.where(small, 1 + x / 2 * (1 + x / 3 * (1 + x / 4 * (1 + x / 5))), jnp.expm1(safe) / safe)
