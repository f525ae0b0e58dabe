"""The interior-point method in `minimise`: published structures with their prices."""

import numpy as np
import pytest

import jaxmbs as mbs

from .test_working_set import PIN, ROD, STABLE, mass, rod_over_a_turn, weight

INTERIOR = {"optimiser": "interior point", "progress": False, "steps": 300}


@pytest.mark.long
def test_the_rod_of_a_slider_crank():
    """Case TB3: two of 720 limits hold the optimum."""
    best = mbs.minimise(rod_over_a_turn, *ROD, limits=[PIN, STABLE], gradient="forward", **INTERIOR)
    assert best.ok, best.reason
    np.testing.assert_allclose(best.design["length"], 0.24545454545454534, rtol=1e-7)
    assert best.value == pytest.approx(0.13779112454716813, rel=2e-8)
    pin, stable = best.limits
    assert pin.prices[0] == pytest.approx(-2.201079002506711 / 8000.0, rel=1e-6)
    assert stable.prices[180] == pytest.approx(-0.0688955622735841, rel=1e-6)


@pytest.mark.long
def test_ten_bars_under_stress_and_displacement():
    """Case TB2, of eight starts: from one of 20 in^2 each the method ends at the local optimum of 5 076.67 lb."""
    limits = [mbs.Limit("stress", "stress", -25e3, 25e3), mbs.Limit("displacement", "displacements", -2.0, 2.0)]
    best = mbs.minimise(weight, np.full(10, 20.0), (0.1, 40.0), limits=limits, starts=8, **INTERIOR)
    assert best.ok and best.value == pytest.approx(5060.853660338411, rel=1e-6)
    assert best.limit("stress").price == pytest.approx(-123.2444862865154 / 25e3, rel=1e-3)
    alone = mbs.minimise(weight, np.full(10, 20.0), (0.1, None), limits=limits[:1], **INTERIOR)
    assert alone.ok and alone.value == pytest.approx(1593.181, rel=1e-6)


@pytest.mark.long
def test_ten_bars_with_frequencies_that_meet():
    """Case TB1: two modes have 20 Hz at the optimum and no gradient each, so that the verdict is not asked."""
    lower = np.array([7.0, 15.0, *np.full(6, 20.0)])
    best = mbs.minimise(mass, np.full(10, 20.0), (0.645, 50.0), limits=[mbs.Limit("f", "f", lower)], **INTERIOR)
    assert best.value == pytest.approx(532.0298092157224, rel=1e-6) and best.limit("f").ok
