"""Fatigue damage and extreme response spectra: closed forms, SciPy, rainflow, derivatives."""

import jax
import numpy as np
import pytest
from scipy.signal import lsim
from scipy.special import gamma

from jaxmbs.errors import ModelError
from jaxmbs.fatigue import SN, psd_table
from jaxmbs.qualification import damage_spectrum

SLOPE, HOUR, STEP = 5.0, 3600.0, 1e-3
FLAT = psd_table([1.0, 5000.0], [2.0, 2.0], "(m/s^2)^2/Hz")
NATURAL = np.array([20.0, 47.0])
SIGNAL = np.random.default_rng(2).normal(size=1500) * 30


def test_flat_spectrum_has_a_closed_form():
    """The RMS is Miles' over w^2, narrow-band damage a gamma function."""
    found = damage_spectrum(FLAT, NATURAL[:1], SN(1.0, SLOPE), duration=HOUR, Q=50.0)
    f = NATURAL[0]
    z = np.sqrt(np.pi / 2 * f * 50.0 * 2.0) / (2 * np.pi * f) ** 2
    damage = f * HOUR * (np.sqrt(2) * z) ** SLOPE * gamma(1 + SLOPE / 2)
    np.testing.assert_allclose(found.damage[0], damage, rtol=2e-3)  # of the band
    np.testing.assert_allclose(found.extreme[0], (2 * np.pi * f) ** 2 * z * np.sqrt(2 * np.log(f * HOUR)), rtol=1e-3)


@pytest.mark.long
def test_samples_against_scipy_and_the_package_rainflow():
    counter = pytest.importorskip("rainflow")
    found = damage_spectrum(SIGNAL, NATURAL, SN(1e-9, SLOPE), step=STEP)
    for f, damage, extreme in zip(NATURAL, found.damage, found.extreme, strict=True):
        w = 2 * np.pi * f
        times = STEP * np.arange(len(SIGNAL))
        z = lsim(([-1.0], [1.0, w / 10, w**2]), SIGNAL, times)[1]
        wanted = sum(n * (r / 2) ** SLOPE / 1e-9 for r, n in counter.count_cycles(z))
        np.testing.assert_allclose(damage, wanted, rtol=1e-9)
        assert extreme >= w**2 * np.abs(z).max() * (1 - 1e-9)


@pytest.mark.long
def test_gradients():
    natural, sn = NATURAL * 1.0, SN(1e-9, SLOPE)

    def random(scale):
        table = psd_table([10.0, 100.0], scale * np.array([1.0, 0.3]), "(m/s^2)^2/Hz")
        found = damage_spectrum(table, natural, sn, duration=60.0, method="dirlik")
        return found.damage * 1e12, found.extreme

    def recorded(scale):
        found = damage_spectrum(scale * SIGNAL[:400], natural * scale**0.1, sn, step=STEP)
        return found.damage * 1e3, found.extreme

    for function in map(jax.jit, (random, recorded)):
        for k, slope in enumerate(jax.jacfwd(function)(1.0)):
            secant = (function(1.0 + 1e-5)[k] - function(1.0 - 1e-5)[k]) / 2e-5
            np.testing.assert_allclose(slope, secant, rtol=1e-6)
        reverse = jax.jacrev(function)(1.0)
        np.testing.assert_allclose(reverse[0], jax.jacfwd(function)(1.0)[0], rtol=1e-9)
        np.testing.assert_allclose(jax.vmap(function)(np.array([1.0, 2.0]))[0][0], function(1.0)[0], rtol=1e-10)


def test_faults():
    with pytest.raises(ModelError) as error:
        damage_spectrum(FLAT, [-1.0], SN(1.0, 3.0), step=1e-3, Q=0.3)
    assert len(error.value.faults) == 4
    with pytest.raises(ModelError, match="one of acceleration"):
        damage_spectrum(psd_table([1.0, 2.0], [1.0, 1.0], "N^2/Hz"), [1.0], SN(1.0, 3.0), duration=1.0)
