"""S-N curves: kinks, limits, ranges."""

import warnings

import jax
import numpy as np
import pytest
from scipy.integrate import quad

from jaxmbs.errors import ModelError
from jaxmbs.fatigue import SN, psd_table, spectral_damage


def test_knee_and_limit():
    sn = SN(1e12, 3.0, knee=50.0, second_slope=5.0, limit=20.0)
    at_knee = 1e12 * 50.0**-3
    np.testing.assert_allclose(sn.cycles(100.0), 1e12 * 100.0**-3)
    np.testing.assert_allclose(sn.cycles(np.array([50.0, 50.0 * (1 - 1e-12)])), at_knee)
    np.testing.assert_allclose(sn.cycles(25.0), at_knee * 2.0**5)
    assert np.isinf(sn.cycles(19.0)) and sn.damage(0.0) == 0


def test_ranges_are_twice_the_amplitudes():
    over_ranges = SN(1e12, 3.0, 100.0, 5.0, 40.0, ranges=True)
    over_amplitudes = SN(1e12 / 8, 3.0, 50.0, 5.0, 20.0)
    for s in (10.0, 30.0, 70.0):
        np.testing.assert_allclose(over_ranges.damage(s), over_amplitudes.damage(s))


def test_slopes_at_zero_are_numbers():
    slope = jax.grad(lambda m: SN(1e12, m, 50.0, 5.0).damage(np.zeros(2)).sum())(3.0)
    assert slope == 0


def test_every_fault_is_named():
    with pytest.raises(ModelError, match="3 faults"):
        SN(-1.0, 0.0, knee=4.0)


@pytest.mark.parametrize("limit", [None, 10.0, 39.99, 40.0, 40.01, 55.0, 90.0, 300.0])
@pytest.mark.parametrize("slopes", [(3.0, 5.0), (5.0, 3.0), (4.0, 4.0)])
def test_a_limit_anywhere_beside_the_knee(limit, slopes):
    """Of the curve point by point, and of its integral over Rayleigh's amplitudes; never a negative damage."""
    knee, c, sigma = 40.0, 1e12, 25.0
    sn = SN(c, slopes[0], knee, slopes[1], limit)

    def damage(s):
        if limit is not None and s < limit:
            return 0.0
        return s ** slopes[0] / c if s >= knee else knee ** slopes[0] / c * (s / knee) ** slopes[1]

    at = np.array([0.0, 5.0, 10.0, 39.0, 40.0, 40.005, 54.0, 55.0, 100.0, 299.0, 301.0])
    np.testing.assert_allclose(sn.damage(at), [damage(s) for s in at], rtol=1e-12)
    start = 0.0 if limit is None else limit
    pdf = lambda s: s / sigma**2 * np.exp(-0.5 * (s / sigma) ** 2) * damage(s)
    wanted = sum(quad(pdf, a, b, epsabs=0.0, epsrel=1e-11)[0] for a, b in _pieces(start, knee, 25 * sigma))
    narrow = psd_table(np.array([9.999, 10.001]), sigma**2 / 0.002 * np.ones(2), unit=None)
    rate = float(spectral_damage(narrow, sn, "narrowband") / narrow.crossings)
    np.testing.assert_allclose(rate, wanted, rtol=1e-8)
    assert rate >= 0


def _pieces(start, knee, end):
    inside = [x for x in (knee, 4 * knee) if start < x < end]
    edges = [start, *inside, max(end, start)]
    return list(zip(edges[:-1], edges[1:], strict=True))


@pytest.mark.parametrize(("intercept", "is_doubted"), [(16.0, True), (1.0, False), (1e3, False), (2e6, False)])
def test_a_logarithm_in_place_of_cycles(intercept, is_doubted):
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        SN(intercept, 5.0)
    assert [str(one.message) for one in said] == [
        "SN: 16 cycles at unit stress: is it the logarithm (intercept=10**16)?"
    ] * is_doubted
