"""Fatigue damage and extreme response spectra: oscillators on a base with a random or a recorded acceleration."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..checks import any_concrete, faults_if, not_positive
from ..errors import ModelError
from ..fatigue._arrays import float_array
from ..fatigue._cycles import rainflow
from ..fatigue._damage import damage as damage_of_history
from ..fatigue._psd import PsdTable
from ..fatigue._sn import SN
from ..fatigue._spectral_damage import spectral_damage
from ..math._exponential import expm
from ..quantities import Axis, Quantity
from ..reports import Report, Reported
from ..runtime import as_dtype, jit
from ..typing import ArrayLike
from ..vibration._modal_equations import _rates
from ._shock_spectrum import KINDS, shock_spectrum

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(96)


class DamageSpectrum(Reported, eqx.Module):
    """Damage and extreme response of oscillators.

    Attributes:
        frequencies: (f,) natural frequencies [Hz].
        damage: (f,) fatigue damage spectrum (FDS), of the amplitudes of the relative displacement.
        extreme: (f,) extreme response spectrum (ERS), pseudo acceleration `(2 pi f)^2 z` [m/s^2].
    """

    frequencies: Float[Array, " f"]
    damage: Float[Array, " f"]
    extreme: Float[Array, " f"]

    def report(self) -> Report:
        frequency = (Axis("frequency", np.asarray(self.frequencies), "Hz"),)
        found = [
            Quantity("damage", self.damage, "", frequency),
            Quantity("extreme response", self.extreme, "m/s^2", frequency),
        ]
        return Report(found, f"{len(self.frequencies)} frequencies")


def damage_spectrum(
    source: Any,
    natural: ArrayLike,
    sn: SN,
    duration: ArrayLike | None = None,
    step: ArrayLike | None = None,
    Q: ArrayLike = 10.0,
    method: str = "narrowband",
) -> DamageSpectrum:
    """Fatigue damage spectrum and extreme response spectrum, to compare environments or to shorten tests.

    Args:
        source: `psd_table` of an acceleration, or (samples,) of one [m/s^2].
        natural: (f,) natural frequencies [Hz], > 0.
        sn: S-N curve of the relative displacement [m]; `SN(1.0, slope)` where only a comparison is asked.
        duration: [s] of a random environment; step: [s] between samples.
        Q: amplification at resonance, > 0.5.
        method: of `spectral_damage`, for a table.

    The extreme of a random environment is `(2 pi f)^2 z sqrt(2 ln(f T))`, z the RMS; of samples it is the shock
    spectrum, with the time after them and between samples.  Cycles are those of rainflow of the motion at the samples
    until the last one: ranges are low by up to `5 (f step)^2` of themselves, f the highest frequency of the motion.

    Raises: ModelError with every fault: another source, numbers that are not positive, `duration` or `step` missing.
    Source: Lalanne (2014), volume 5; ASTM E1049-85.
    """
    table = source if isinstance(source, PsdTable) else None
    natural = jnp.atleast_1d(float_array(natural))
    given, wrong = (duration, step) if table is not None else (step, duration)
    names = ("duration", "step") if table is not None else ("step", "duration")
    faults = faults_if(
        (not_positive(natural) or natural.ndim != 1, "natural frequencies must be a row of positive numbers"),
        (not isinstance(sn, SN), "sn must be a fatigue.SN"),
        (any_concrete(lambda q: ~(q > 0.5), Q), f"Q = {Q} must be above 0.5: the damping ratio is 1 / (2 Q)"),
        (given is None or not_positive(given), f"{names[0]} = {given} must be a positive time [s]"),
        (wrong is not None, f"{names[1]} = {wrong} is not used by this source: leave it out"),
        (table is not None and table.quantity != "acceleration", "the table must be one of acceleration"),
    )
    if faults:
        raise ModelError(faults, "the damage spectrum")
    if table is not None:
        assert duration is not None
        f = as_dtype(natural, table.levels.dtype)
        return DamageSpectrum(f, *_random(table, f, as_dtype(Q, f.dtype), sn, as_dtype(duration, f.dtype), method))
    assert step is not None
    shock = shock_spectrum(source, step, natural, Q, KINDS[1])
    f = shock.frequencies
    signal = as_dtype(source, f.dtype)
    found = _recorded(signal, as_dtype(step, f.dtype), f, as_dtype(Q, f.dtype), sn)
    return DamageSpectrum(f, found, (2 * jnp.pi * f) ** 2 * shock.maximax)


class _Displacement(eqx.Module):
    """Spectrum of the relative displacement of an oscillator on a random base."""

    table: PsdTable
    natural: Array
    Q: Array

    def moments(self, orders):
        """Moments (orders,) of the displacement [m^2 Hz^order]; nodes are even over the phase of the resonance."""
        f0, table = self.natural, self.table
        width = f0 / (2 * self.Q)
        angle = jnp.arctan((table.frequencies - f0) / width)
        half = 0.5 * jnp.diff(angle)
        x, w = (jnp.asarray(part, f0.dtype) for part in (_NODES, _WEIGHTS))
        at = 0.5 * (angle[1:] + angle[:-1])[:, None] + half[:, None] * x[None]
        f = f0 + width * jnp.tan(at)
        r = f / f0
        gain = 1 / ((1 - r**2) ** 2 + (r / self.Q) ** 2) / (2 * jnp.pi * f0) ** 4
        found = table.at(f) * gain * width / jnp.cos(at) ** 2
        return jnp.stack([jnp.sum(half * ((found * f**n) @ w)) for n in orders])


@jit
def _random(table, natural, Q, sn, duration, method):
    def one(f0):
        z = _Displacement(table, f0, Q)
        rate = spectral_damage(z, sn, method)
        peak = jnp.sqrt(2 * jnp.log(jnp.maximum(f0 * duration, 1.5)))
        return rate * duration, (2 * jnp.pi * f0) ** 2 * jnp.sqrt(z.moments((0,))[0]) * peak

    return jax.vmap(one)(natural)


@jit
def _recorded(signal, step, natural, Q, sn):
    """Damage (f,) of the motions, one oscillator after the other."""

    def one(f0):
        w, rate = 2 * jnp.pi * f0, 2 * jnp.pi * f0 / Q
        scale = jnp.maximum(lax.stop_gradient(w), 1 / lax.stop_gradient(step))
        whole = expm(step * _rates(w**2, rate, scale, step))[:2]

        def advance(state, load):
            before, after = load
            state = (
                whole[:, 0] * state[0]
                + whole[:, 1] * state[1]
                + whole[:, 2] * before
                + whole[:, 3] * (after - before)
            )
            return state, state[0]

        z = lax.scan(advance, jnp.zeros(2, signal.dtype), (-signal[:-1], -signal[1:]))[1]
        motion = jnp.concatenate([jnp.zeros(1, z.dtype), z])
        return damage_of_history(rainflow(motion), sn)

    return lax.map(one, natural)
