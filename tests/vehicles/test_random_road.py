"""Random roads: spectra against ISO 8608, coherence against SciPy, profiles against both."""

import jax
import numpy as np
import pytest
import scipy.signal
import scipy.special

import jaxmbs as mbs
from jaxmbs.vehicles import RandomRoad

KEY = jax.random.PRNGKey(3)


def test_classes():
    """Printed means of the standard: 16, 64, 256, 1024, 4096 10^-6 m^3 at 0.1 1/m."""
    levels = [float(RandomRoad.of_class(name).level) for name in "ABCDE"]
    np.testing.assert_allclose(levels, np.array([16, 64, 256, 1024, 4096]) * 1e-6)
    with pytest.raises(ValueError, match="class"):
        RandomRoad.of_class("Z")
    with pytest.raises(mbs.ModelError, match="positive"):
        RandomRoad(0.0)


def test_acceleration_of_a_wheel():
    road, v = RandomRoad.of_class("C"), 20.0
    table = road.acceleration_table(v, 0.5, 50.0)
    for f in (0.5, 3.0, 50.0):
        n = f / v
        np.testing.assert_allclose(table.at(f), (2 * np.pi * f) ** 4 * 2.56e-4 * (n / 0.1) ** -2 / v, rtol=1e-12)
        np.testing.assert_allclose(table.at(f), road.speed_level(v) * (2 * np.pi * f) ** 2, rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("waviness", [2.0, 2.5])
def test_coherence_of_two_tracks(waviness):
    road = RandomRoad(1e-6, waviness)
    n = np.array([0.0, 1e-4, 0.01, 0.1, 0.5, 3.0])
    z, v = 2 * np.pi * n[1:] * 1.6, waviness / 2
    wanted = 2 * (z / 2) ** v * scipy.special.kv(v, z) / scipy.special.gamma(v)
    np.testing.assert_allclose(road.coherence(n, 1.6), [1.0, *wanted], rtol=1e-10)
    slope = jax.grad(lambda b: road.coherence(0.1, b))(1.6)
    np.testing.assert_allclose(slope, (road.coherence(0.1, 1.6001) - road.coherence(0.1, 1.5999)) / 2e-4, rtol=1e-6)


@pytest.mark.long
def test_profiles_have_the_spectrum_and_the_coherence():
    road, x = RandomRoad.of_class("C"), 0.1 * np.arange(2**14)
    left, right = np.asarray(road.profile(x, KEY, (0.8, -0.8))).T
    n, S = scipy.signal.welch(left, 10.0, nperseg=2048)
    _, crossed = scipy.signal.csd(left, right, 10.0, nperseg=2048)
    band = (n > 0.02) & (n < 1.0)
    np.testing.assert_allclose(np.mean(np.log(S[band] / road.density(n[band]))), 0.0, atol=0.12)
    low, high = (n > 0.01) & (n < 0.03), (n > 0.3) & (n < 1.0)
    for part in (low, high):
        found = np.sum(crossed[part].real) / np.sum(S[part])
        wanted = np.sum(road.coherence(n[part], 1.6) * S[part]) / np.sum(S[part])
        np.testing.assert_allclose(found, wanted, atol=0.1)
    smooth = np.asarray(road.filtered_profile(x, KEY))
    n, S = scipy.signal.welch(smooth, 10.0, nperseg=2048)
    band = (n > 0.04) & (n < 1.0)
    np.testing.assert_allclose(np.mean(np.log(S[band] / road.density(n[band]))), 0.0, atol=0.12)


@pytest.mark.slow
def test_profiles_scale_with_the_level_and_repeat_with_the_key():
    x = np.arange(64) * 0.5
    one, four = (RandomRoad(level).profile(x, KEY, lines=50) for level in (1e-6, 4e-6))
    np.testing.assert_allclose(four, 2 * one, rtol=1e-12)
    slope = jax.grad(lambda level: RandomRoad(level).filtered_profile(x, KEY)[5])(1e-6)
    np.testing.assert_allclose(slope, RandomRoad(1e-6).filtered_profile(x, KEY)[5] / 2e-6, rtol=1e-10)
    with pytest.raises(mbs.ModelError, match="tracks"):
        RandomRoad(1e-6).profile(x, KEY, (0.0, 1.0, 2.0))
