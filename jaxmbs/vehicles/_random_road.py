"""Random roads: spectra of ISO 8608, coherence of two tracks, profiles by noise."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..checks import check_count, faults_if, no_such, not_positive
from ..errors import ModelError
from ..fatigue import PsdTable, psd_table
from ..forces._fields import number, value_faults
from ..tables import fields_repr
from ..typing import ArrayLike, Convertible, Scalar, ScalarLike

REFERENCE = 0.1  # wave number at which roads are graded [1/m]
#: Geometric mean of the displacement spectrum of each class at 0.1 1/m [m^3].
CLASSES = {name: 16e-6 * 4.0**k for k, name in enumerate("ABCDEFGH")}
_NODES = 0.05 * np.arange(1, 400)  # of the integral of a Bessel function


class RandomRoad(eqx.Module):
    """A random road, with one-sided spectrum `level (n / 0.1)^-waviness` of heights over the wave number n [1/m].

    Attributes:
        level: at 0.1 1/m [m^3].
        waviness: exponent, 2 in ISO 8608: then the vertical speed of a wheel is white noise.

    Source: ISO 8608 (2016).
    """

    level: Convertible[Scalar] = eqx.field(converter=number)
    waviness: Convertible[Scalar] = eqx.field(converter=number, default=2.0)

    __repr__ = fields_repr

    def __check_init__(self):
        faults = value_faults(self) + faults_if(
            (not_positive(self.level), "level must be positive"),
            (self.level.shape != () or self.waviness.shape != (), "level and waviness are one number each"),
            (not_positive(self.waviness - 1.0), "waviness must be more than 1"),
        )
        if faults:
            raise ModelError(faults, "the road")

    @classmethod
    def of_class(cls, name: str) -> "RandomRoad":
        """The mean of a class, "A" (very good) to "H".  Raises: ValueError."""
        if name not in CLASSES:
            raise ValueError(no_such("class", name, CLASSES))
        return cls(CLASSES[name])

    def density(self, wave_number: ArrayLike) -> Array:
        """Spectrum of heights [m^3] at wave numbers [1/m], one-sided."""
        return self.level * (number(wave_number) / REFERENCE) ** -self.waviness

    def speed_level(self, speed: ScalarLike) -> Scalar:
        """Level of the white vertical speed of a wheel [(m/s)^2/Hz], one-sided, of waviness 2, at a speed [m/s]."""
        return (2.0 * np.pi * REFERENCE) ** 2 * self.level * number(speed)

    def acceleration_table(
        self, speed: ScalarLike, lowest: ScalarLike = 0.1, highest: ScalarLike = 100.0
    ) -> PsdTable:
        """Spectrum of the vertical acceleration of a wheel, between two frequencies [Hz], for `random_response`.

        Straight on log-log paper, so that two points are exact.  Raises: ModelError for a speed that is not positive.
        """
        if not_positive(speed):
            raise ModelError(["speed must be positive"], "the road")
        f, v = jnp.stack([number(lowest), number(highest)]), number(speed)
        return psd_table(f, (2.0 * np.pi * f) ** 4 * self.density(f / v) / v, unit="(m/s^2)^2/Hz")

    def coherence(self, wave_number: ArrayLike, track: ScalarLike) -> Array:
        """Coherence of the heights of two tracks at a distance [m], at wave numbers [1/m].

        `S_ab / S` of a surface that is alike in all directions: `2 (z/2)^(w/2) K_w/2(z) / Gamma(w/2)` with
        `z = 2 pi n track`; of waviness 2 this is `z K_1(z)`.  Source: Dodds and Robson (1973).
        """
        z = 2.0 * np.pi * number(wave_number) * number(track)
        half = 0.5 * self.waviness
        safe = jnp.where(z > 1e-6, z, 1.0)
        log_gamma = jax.scipy.special.gammaln(half)
        found = 2.0 * jnp.exp(half * jnp.log(0.5 * safe) - log_gamma) * _bessel(half, safe)
        return jnp.where(z > 1e-6, found, 1.0)

    def profile(
        self, x: ArrayLike, key: Any, tracks: tuple[ScalarLike, ...] = (0.0,), lines: int = 2000
    ) -> Float[Array, "points tracks"]:
        """Heights (points, tracks) [m] by waves of random phases, coherent between the tracks.

        Args:
            x: (points,) places, evenly spaced and rising [m]: waves are between once over all of them and half of the
                inverse spacing.
            key: of `jax.random`; one key gives one road, also at another level.
            tracks: one or two places to the side [m].
            lines: number of waves, evenly spaced on a logarithmic scale.

        Raises: ModelError for places or tracks that are none.
        """
        x = number(x)
        check_count("lines", lines, 2)
        faults = faults_if(
            (x.ndim != 1 or x.size < 3, "x must be three or more places"),
            (len(tracks) not in (1, 2), f"tracks must be one or two, not {len(tracks)}"),
        )
        if faults:
            raise ModelError(faults, "the profile")
        length, spacing = x[-1] - x[0], (x[-1] - x[0]) / (x.size - 1)
        edges = jnp.geomspace(1.0 / length, 0.5 / spacing, lines + 1)
        n, width = jnp.sqrt(edges[1:] * edges[:-1]), jnp.diff(edges)
        size = jnp.sqrt(2.0 * self.density(n) * width)
        phases = jax.random.uniform(key, (2, lines), n.dtype, 0.0, 2.0 * np.pi)
        waves = 2.0 * np.pi * x[:, None] * n[None]
        own, other = (jnp.cos(waves + phase[None]) for phase in phases)
        if len(tracks) == 1:
            return (own @ size)[:, None]
        common = self.coherence(n, abs(number(tracks[1]) - number(tracks[0])))
        rest = jnp.sqrt(jnp.maximum(1.0 - common**2, 0.0))
        return jnp.stack([own @ size, own @ (size * common) + other @ (size * rest)], axis=1)

    def filtered_profile(self, x: ArrayLike, key: Any, cutoff: ScalarLike = 0.01) -> Float[Array, " points"]:
        """Heights (points,) [m] by filtered white noise, of waviness 2: exact at the places, for every spacing.

        Args:
            x: (points,) rising places [m].
            cutoff: wave number below which the spectrum is flat [1/m], so that heights are bounded.

        Raises: ModelError for places or a cutoff that are none.
        """
        x, a = number(x), 2.0 * np.pi * number(cutoff)
        if x.ndim != 1 or x.size < 2 or not_positive(cutoff):
            raise ModelError(["x must be two or more places, cutoff positive"], "the profile")
        variance = np.pi * REFERENCE**2 * self.level / (2.0 * number(cutoff))
        decay = jnp.exp(-a * jnp.diff(x))
        noise = jax.random.normal(key, x.shape, x.dtype) * jnp.sqrt(variance)

        def step(height, given):
            decay, noise = given
            height = decay * height + jnp.sqrt(1.0 - decay**2) * noise
            return height, height

        rest = lax.scan(step, noise[0], (decay, noise[1:]))[1]
        return jnp.concatenate([noise[:1], rest])


def _bessel(order, z):
    """Modified Bessel function of the second kind by the trapezium rule, which converges geometrically here.

    `K_v(z) = integral exp(-z cosh t) cosh(v t) dt` over t > 0.  Source: Abramowitz and Stegun (1964), 9.6.24.
    """
    t = jnp.asarray(_NODES, z.dtype)

    def one(z):
        growth, fall = jnp.exp(-z * jnp.cosh(t) + order * t), 0.5 + 0.5 * jnp.exp(-2.0 * order * t)
        return 0.05 * (0.5 * jnp.exp(-z) + jnp.sum(growth * fall))

    return jax.vmap(one)(z.ravel()).reshape(z.shape)
