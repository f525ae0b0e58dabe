"""`HarmonicCycles`: steady states of linear systems with local laws, as harmonics of a frequency."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float

from ..checks import check_count, place_of
from ..quantities import Axis, Quantity
from ..reports import Report, Reported, failures


class HarmonicCycles(Reported, eqx.Module):
    """Steady states (S,) over a frequency: displacements are `Re sum_k a_k exp(i k omega t)`.

    Attributes:
        omega: (S,) [rad/s] of the first harmonic.
        amplitudes: (S, H, n) [m, rad] of the coordinates.
        forces: (S, H, p) [N, N m] of the local laws on the system.
        residual: (S,) by which the local displacements miss their equations, over their size.
        ok: (S,) true where it is small; numbers are NaN elsewhere.
        neglected: (S,) by which the forces of the laws at harmonics that are left out, up to two above the highest,
            would move the local displacements, over their size; without derivative.
        harmonics: numbers (H,) of the harmonics (static); coordinates: names (n,) (static); laws: names (p,) of the
            local displacements (static).
    """

    omega: Float[Array, " S"]
    amplitudes: Complex[Array, "S H n"]
    forces: Complex[Array, "S H p"]
    residual: Float[Array, " S"]
    ok: Bool[Array, " S"]
    neglected: Float[Array, " S"]
    harmonics: tuple[int, ...] = eqx.field(static=True)
    coordinates: tuple[str, ...] = eqx.field(static=True)
    laws: tuple[str, ...] = eqx.field(static=True)

    def report(self) -> Report:
        axes = Axis("frequency", np.asarray(self.omega), "rad/s"), Axis("harmonic", self.harmonics)
        found = [
            Quantity("amplitude", self.amplitudes, "m", (*axes, Axis("coordinate", self.coordinates))),
            Quantity("local force", self.forces, "N", (*axes, Axis("law", self.laws))),
            Quantity("share of harmonics left out", self.neglected, "", axes[:1]),
        ]
        return Report(found, fault=failures(self.ok, "frequencies without a steady state"))

    def history(self, coordinate: str, samples: int = 128) -> Float[Array, "S samples"]:
        """Displacements over one period, from t = 0 on, at equal times without its end.  Raises: ModelError."""
        check_count("samples", samples, 1)
        values = self.amplitudes[:, :, place_of("coordinate", coordinate, self.coordinates)]
        phase = 2.0 * np.pi * np.outer(self.harmonics, np.arange(samples) / samples)
        return (values @ jnp.asarray(np.exp(1j * phase), values.dtype)).real

    def peak(self, coordinate: str, samples: int = 128) -> Float[Array, " S"]:
        """Largest displacement, of either sign, over the period: the largest of the samples, then Newton's method.

        Raises: ModelError.
        """
        x = jax.lax.stop_gradient(jnp.abs(self.history(coordinate, samples)))
        a = self.amplitudes[:, :, place_of("coordinate", coordinate, self.coordinates)]
        k = jnp.asarray(1j * np.asarray(self.harmonics)[None, :], a.dtype)
        fixed = jax.lax.stop_gradient(a)
        wave = lambda tau, order: jnp.exp(k * tau[:, None].astype(a.dtype)) * k**order
        tau = 2.0 * np.pi / samples * jnp.argmax(x, axis=1).astype(x.dtype)
        for _ in range(4):
            slope, curve = (jnp.sum((fixed * wave(tau, order)).real, axis=1) for order in (1, 2))
            step = -slope / jnp.where(curve == 0.0, 1.0, curve)
            tau = tau + jnp.clip(step, -np.pi / samples, np.pi / samples)
        return jnp.abs(jnp.sum((a * wave(tau, 0)).real, axis=1))
