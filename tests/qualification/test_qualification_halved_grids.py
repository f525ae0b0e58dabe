"""Grids that answers do not depend on: half of every step changes nothing that is stated."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.fatigue import SN, psd_table, spectral_damage
from jaxmbs.qualification import (
    BaseAcceleration,
    Recovery,
    damage_spectrum,
    random_response,
    random_spectrum,
    response_spectrum,
    shock_spectrum,
    sine_response,
    stress_spectrum,
)

from .test_random_response import GSFC, SPRINGS, chain, oscillator

INPUT = {"base": BaseAcceleration(GSFC, "z")}
NATURAL = np.array([35.0, 180.0, 1500.0])
STEP = 1e-4
SIGNAL = np.convolve(np.random.default_rng(1).normal(size=400), np.hanning(9), "same")
ROWS = Recovery(jnp.array([[1.0, 0, 0], [-0.3, 0.2, 0], [0.1, 0, 0.4]]), ["x", "y", "xy"])


def halved(x, between):
    """Points and those half way between them."""
    x = np.asarray(x)
    found = np.empty(2 * len(x) - 1)
    found[::2], found[1::2] = x, between(x[:-1], x[1:])
    return found


def straight(a, b):
    return (a + b) / 2


def by_ratio(a, b):
    return np.sqrt(a * b)


def finer_table(table):
    return tuple(halved(part, by_ratio) for part in (table.frequencies, table.levels))


def points_of_the_quadrature(fine):
    found = random_response(chain(SPRINGS), INPUT, {"s": ROWS}, ratios=0.02, order=48 if fine else 24)
    life = spectral_damage(stress_spectrum(found, "s x"), SN(1e12, 4.0), "dirlik")
    return *found.moments.T, found.von_mises_rms(found.names), found.expected_maximum(60.0), life


def points_of_the_table(fine):
    f, G = finer_table(GSFC) if fine else (GSFC.frequencies, GSFC.levels)
    table = psd_table(f, G, "(m/s^2)^2/Hz")
    found = random_response(chain(SPRINGS), {"base": BaseAcceleration(table, "z")}, {"s": ROWS}, ratios=0.02)
    return (
        *found.moments.T,
        random_spectrum(f, G, NATURAL),
        damage_spectrum(table, NATURAL, SN(1e12, 4.0), 60.0).damage,
    )


def samples_of_a_shock(fine):
    """Motion after a signal that is straight between samples."""
    signal = np.concatenate([SIGNAL, np.zeros(1)])
    given = (halved(signal, straight), STEP / 2) if fine else (signal, STEP)
    return (shock_spectrum(*given, NATURAL).residual,)


def points_of_a_response_spectrum(fine):
    f, a = np.array([5.0, 60.0, 900.0]), np.array([2.0, 30.0, 11.0])
    given = (halved(f, by_ratio), halved(a, by_ratio)) if fine else (f, a)
    return (response_spectrum(chain(SPRINGS), given, {"s": ROWS}, "cqc", ratios=0.02, unit="m/s^2").peaks,)


def points_of_a_sine_sweep(fine):
    levels = (np.array([20.0, 50.0, 800.0]), np.array([1.0, 8.0, 3.0]))
    found = sine_response(
        chain(SPRINGS), levels, {"s": ROWS}, ratios=0.02, notch={"s": 8.0}, points=128 if fine else 64, unit="g"
    )
    return found.peaks, found.fastest_sweep


ANSWERS = {f.__name__: f for f in (points_of_the_table, points_of_a_response_spectrum, samples_of_a_shock)}


@pytest.mark.long
@pytest.mark.parametrize("answer", [*ANSWERS.values(), points_of_the_quadrature], ids=lambda f: f.__name__)
def test_half_of_a_step_changes_nothing(answer):
    for coarse, fine in zip(answer(False), answer(True), strict=True):
        np.testing.assert_allclose(fine, coarse, rtol=2e-11)


@pytest.mark.long
def test_peaks_of_a_sine_sweep_are_found():
    for coarse, fine in zip(points_of_a_sine_sweep(False), points_of_a_sine_sweep(True), strict=True):
        np.testing.assert_allclose(fine, coarse, rtol=2e-4)  # resonances of sums lie beside those of the modes


@pytest.mark.parametrize("Q", [0.8, 10.0, 1e3])
def test_band_integral_of_an_oscillator_in_closed_form(Q):
    """Flat spectrum: `|H|^2` in partial fractions, whose integrals are logarithms."""
    f, band = 97.0, (20.0, 400.0)
    found = random_response(
        oscillator(f, Q), {"base": BaseAcceleration(psd_table(band, [2.5, 2.5], "(m/s^2)^2/Hz"), "z")}, ["m z"]
    )
    zeta = 0.5 / Q
    poles = np.sqrt(1 - zeta**2 + 0j) + np.array([1j, -1j]) * zeta
    poles = np.concatenate([poles, -poles])
    top = 1 + 4 * zeta**2 * poles**2
    ends = np.array(band) / f
    for column, power in ((0, 0), (2, 2)):
        residues = [
            t * p**power / np.prod(p - np.delete(poles, k)) for k, (t, p) in enumerate(zip(top, poles, strict=True))
        ]
        # of the second moment the fraction has a whole part, 4 zeta^2
        exact = sum(r * np.log((ends[1] - p) / (ends[0] - p)) for r, p in zip(residues, poles, strict=True))
        exact = exact.real + (4 * zeta**2 * (ends[1] - ends[0]) if power == 2 else 0.0)
        np.testing.assert_allclose(found.moments[0, column], 2.5 * f ** (power + 1) * exact, rtol=1e-11)
