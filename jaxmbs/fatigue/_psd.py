"""Tables of power spectral density, one-sided over hertz, straight lines between points on log-log paper."""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..checks import UNSAID, any_concrete, faults_if, is_concrete, not_positive, said_unit
from ..errors import ModelError, warn
from ..runtime import as_dtype
from ..tables import fields_repr
from ..typing import ArrayLike
from ._arrays import float_array
from ._log_lines import frequency_faults, log_lines

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
    """Power spectral density, **one-sided, over Hz**, a power law between points; zero outside of the table.

    A frequency that stands twice is a step: the first level is that below it, the second that above.  `psd_table`
    makes a table, from other conventions too.

    Attributes:
        frequencies: (points,) [Hz], positive and rising.
        levels: (points,) in SI units squared per Hz, or in the unit of the user; positive.
        quantity: "acceleration", "force" or "any" (static).
    """

    frequencies: Float[Array, " points"]
    levels: Float[Array, " points"]
    quantity: str = eqx.field(static=True)

    __repr__ = fields_repr

    def moments(self, orders: Sequence[float | int]) -> Float[Array, " orders"]:
        """Spectral moments `integral f^n G df` (orders,), exact for the power laws; a level of zero leaves none."""
        f, g = self.frequencies, self.levels
        silent = (g[1:] == 0) | (g[:-1] == 0)
        log = jnp.log(jnp.where(g == 0, 1.0, g))
        step, rise = jnp.log1p(jnp.diff(f) / f[:-1]), jnp.diff(log)
        found = []
        for n in orders:
            area = g[:-1] * f[:-1] ** (n + 1.0) * step * _mean_exponential(rise + (n + 1.0) * step)
            found.append(jnp.sum(jnp.where(silent, 0.0, area)))
        return jnp.stack(found)

    def moment(self, order: float | int) -> Float[Array, ""]:
        """Spectral moment `integral f^order G df` ()."""
        return self.moments((order,))[0]

    @property
    def mean_square(self) -> Float[Array, ""]:
        """Mean square ()."""
        return self.moment(0)

    @property
    def rms(self) -> Float[Array, ""]:
        """Root of the mean square ()."""
        m0 = self.moment(0)
        return jnp.where(m0 == 0, 0.0, jnp.sqrt(jnp.where(m0 == 0, 1.0, m0)))

    @property
    def crossings(self) -> Float[Array, ""]:
        """Upward zero crossings per second: `sqrt(m2 / m0)`."""
        m0, m2 = self.moments((0, 2))
        return jnp.sqrt(m2 / m0)

    @property
    def peaks(self) -> Float[Array, ""]:
        """Peaks per second: `sqrt(m4 / m2)`.  The fourth moment grows with the band where levels fall slower than
        `f^-5`: an absolute acceleration has no rate of peaks of its own, only one of its band."""
        m2, m4 = self.moments((2, 4))
        return jnp.sqrt(m4 / m2)

    def at(self, frequencies: ArrayLike, side: str = "right") -> Array:
        """Levels at any frequencies (...,) [Hz]; zero outside of the table.

        Args: side: of a step, "right" (above) or "left" (below), on which the level exactly at it is taken.

        Raises: ValueError for another side.
        """
        if side not in ("left", "right"):
            raise ValueError(f"side = {side!r} must be 'left' or 'right'")
        f = as_dtype(frequencies, self.levels.dtype)
        found = log_lines(jnp.where(f > 0, f, 1.0), self.frequencies, self.levels, side)
        edge = 64 * jnp.finfo(found.dtype).eps  # nodes at an end may round to outside
        low, high = lax.stop_gradient((self.frequencies[0] * (1 - edge), self.frequencies[-1] * (1 + edge)))
        return jnp.where((f >= low) & (f <= high), found, 0.0)

    def scale(self, decibels: ArrayLike) -> "PsdTable":
        """The table raised by decibels, 3 dB doubling it."""
        factor = 10.0 ** (as_dtype(decibels, self.levels.dtype) / 10.0)
        return PsdTable(self.frequencies, self.levels * factor, self.quantity)


def psd_table(
    frequencies: ArrayLike,
    levels: ArrayLike,
    unit: str | None = UNSAID,
    *,
    frequency_unit: str = "Hz",
    sides: int = 1,
) -> PsdTable:
    """Power spectral density from a table, straight between its points on log-log paper.

    Args:
        frequencies: (points,), positive and rising; one that stands twice is a step, with the levels below and above.
        levels: (points,), positive.
        unit: of the levels: "g^2/Hz", "(m/s^2)^2/Hz", "(rad/s^2)^2/Hz", "N^2/Hz", "(N m)^2/Hz" or "Pa^2/Hz".
            None: levels of any quantity, as the stress of an S-N curve in MPa, which stay as they are.  Where none is
            said, "g^2/Hz" is taken, with a warning.
        frequency_unit: "Hz", or "rad/s": then the levels too are per rad/s and are converted.
        sides: 1, or 2 for levels that negative frequencies share, which are doubled.

    Raises: ModelError with every fault.
    """
    unit = said_unit("psd_table", unit, "g^2/Hz")
    f, S = float_array(frequencies), float_array(levels)
    sizes = f.ndim == 1 and f.shape == S.shape and f.size > 1
    faults = faults_if(
        (not sizes, f"frequencies {f.shape} and levels {S.shape} must be two or more numbers each"),
        (not_positive(S), "levels must be positive: lines on log-log paper do not reach zero"),
        (any_concrete(lambda x: x == np.inf, S), "levels must be finite"),
        (unit is not None and unit not in UNITS, f"unknown unit {unit!r}: the units are {', '.join(UNITS)}"),
        (frequency_unit not in ("Hz", "rad/s"), f"frequency_unit = {frequency_unit!r} must be 'Hz' or 'rad/s'"),
        (sides not in (1, 2), f"sides = {sides!r} must be 1 or 2"),
    )
    faults += frequency_faults(f) if sizes else []
    if faults:
        raise ModelError(faults, "the table")
    if frequency_unit == "Hz" and _is_round_in_hertz(f):
        warn(
            "psd_table: the frequencies are round numbers of Hz times 2 pi: are they rad/s (frequency_unit='rad/s')?"
        )
    quantity, size = ("any", 1.0) if unit is None else UNITS[unit]
    per = 2 * np.pi if frequency_unit == "rad/s" else 1.0
    return PsdTable(f / per, S * (size * per * sides), quantity)


def _is_round_in_hertz(f):
    """True for concrete frequencies that have three digits once they are divided by 2 pi, and not before."""
    if not is_concrete(f):
        return False
    f = np.asarray(f)
    return bool(np.all(_is_round(f / (2 * np.pi))) and not np.any(_is_round(f)))


def _is_round(x):
    size = 10.0 ** (np.floor(np.log10(x)) - 2)
    return np.abs(x / size - np.round(x / size)) < 1e-6


def _mean_exponential(x):
    """`(e^x - 1) / x`, one at zero."""
    small = jnp.abs(x) < 1e-3
    safe = jnp.where(small, 1.0, x)
    return jnp.where(small, 1 + x / 2 * (1 + x / 3 * (1 + x / 4 * (1 + x / 5))), jnp.expm1(safe) / safe)
