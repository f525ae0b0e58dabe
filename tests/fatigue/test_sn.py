"""S-N curves: kinks, limits, ranges."""

import jax
import numpy as np
import pytest

from jaxmbs.errors import ModelError
from jaxmbs.fatigue import SN


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
