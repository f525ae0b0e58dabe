"""Moments of spectra: quadrature, both conventions."""

import jax
import numpy as np
import pytest
from scipy.integrate import quad

from jaxmbs.errors import ModelError
from jaxmbs.fatigue import Spectrum

F, G = np.array([0.0, 2.0, 3.0, 3.001, 9.0]), np.array([1.0, 4.0, 4.5, 0.3, 0.0])


@pytest.mark.parametrize("order", [0, 0.75, 1, 2, 4])
def test_moments(order):
    wanted = sum(
        quad(lambda f: f**order * np.interp(f, F, G), a, b, epsabs=1e-13)[0]
        for a, b in zip(F[:-1], F[1:], strict=True)
    )
    np.testing.assert_allclose(Spectrum(F, G).moment(order), wanted, rtol=1e-9)


def test_conventions():
    one = Spectrum(F, G)
    other = Spectrum.of(2 * np.pi * F, G / (2 * np.pi) / 2, two_sided=True, angular=True)
    for order in (0, 2):
        np.testing.assert_allclose(other.moment(order), one.moment(order), rtol=1e-12)


def test_narrow_band_in_short_pieces():
    narrow = Spectrum(20 + 1e-7 * np.arange(3), np.array([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(narrow.moment(4) / narrow.moment(0), 20.0**4, rtol=1e-7)
    np.testing.assert_allclose([narrow.crossings, narrow.peaks], 20.0, rtol=1e-7)
    np.testing.assert_allclose(jax.grad(lambda g: Spectrum(F, g).rms)(np.zeros(5)), 0)


def test_every_fault_is_named():
    with pytest.raises(ModelError, match="2 faults"):
        Spectrum([-1.0, 3.0, 2.0], [1.0, 1.0, 1.0])
