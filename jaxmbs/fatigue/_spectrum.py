"""A stress spectrum given by points, and its moments."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import any_concrete, faults_if, negative, not_increasing
from ..errors import ModelError
from ..typing import ArrayLike, Convertible, Scalar
from ._arrays import float_array

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


class Spectrum(eqx.Module):
    """Power spectral density of a stress: **one-sided, over Hz**, straight between its points and zero outside.

    Attributes:
        frequencies: (points,) [Hz], increasing, not negative.
        levels: (points,) [unit^2 / Hz], not negative.

    `Spectrum.of(..., two_sided=True, angular=True)` takes the other conventions.
    Raises: ModelError, if concrete, for frequencies that do not increase and negative or missing numbers.
    """

    frequencies: Convertible[Float[Array, " points"]] = eqx.field(converter=float_array)
    levels: Convertible[Float[Array, " points"]] = eqx.field(converter=float_array)

    def __check_init__(self):
        f, g = self.frequencies, self.levels
        faults = faults_if(
            (f.ndim != 1 or f.shape != g.shape or f.size < 2, f"frequencies {f.shape} and levels {g.shape} must be "
             "two rows of equal length, of at least two points"),
            (not_increasing(f), "frequencies must increase"),
            (negative(f), "frequencies must not be negative: of a two-sided spectrum give the positive half"),
            (negative(g), "levels must not be negative"),
            (not _finite(f) or not _finite(g), "all numbers must be finite"),
        )  # fmt: skip
        if faults:
            raise ModelError(faults, "the spectrum")

    @staticmethod
    def of(
        frequencies: ArrayLike, levels: ArrayLike, *, two_sided: bool = False, angular: bool = False
    ) -> "Spectrum":
        """One-sided spectrum over Hz from another convention.

        Args:
            two_sided: true if half the variance lies at negative frequencies, which are left out here.
            angular: true for frequencies in rad/s and levels in unit^2 s / rad.
        """
        turn = 2 * np.pi if angular else 1.0
        return Spectrum(float_array(frequencies) / turn, float_array(levels) * turn * (2 if two_sided else 1))

    def moment(self, order: float | int) -> Scalar:
        """Spectral moment `int f^order G df` of the straight lines, to rounding [unit^2 Hz^order]."""
        f, g = self.frequencies, self.levels
        low, width = f[:-1], jnp.diff(f)
        slope = jnp.diff(g) / width
        power = lambda n: jnp.diff(f ** (n + 1.0)) / (n + 1.0)  # noqa: E731
        closed = (g[:-1] - slope * low) * power(order) + slope * power(order + 1)
        x, w = (jnp.asarray(v, f.dtype) for v in (0.5 + 0.5 * _NODES, 0.5 * _WEIGHTS))
        share = (
            jnp.where(low > 0, low, 1.0)[:, None] + width[:, None] * x[None]
        )  # the closed form cancels in short pieces
        summed = width * ((share**order * (g[:-1, None] + jnp.diff(g)[:, None] * x[None])) @ w)
        return jnp.sum(jnp.where(2 * low > f[1:], summed, closed))

    @property
    def rms(self) -> Scalar:
        """Root of the variance."""
        m0 = self.moment(0)
        return jnp.where(m0 > 0, jnp.sqrt(jnp.where(m0 > 0, m0, 1.0)), 0.0)

    @property
    def crossings(self) -> Scalar:
        """Upward zero crossings per second."""
        return jnp.sqrt(self.moment(2) / self.moment(0))

    @property
    def peaks(self) -> Scalar:
        """Peaks per second.  It rests on the fourth moment, which grows with the band where levels fall slower than
        `f^-5`: an absolute acceleration has no rate of peaks of its own, only one of its band."""
        return jnp.sqrt(self.moment(4) / self.moment(2))


def _finite(x):
    return not any_concrete(lambda v: ~np.isfinite(v), x)
