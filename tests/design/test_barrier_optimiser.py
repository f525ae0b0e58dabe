"""The interior-point method in `minimise`: published structures with their prices."""

import numpy as np
import pytest

import jaxmbs as mbs

from .test_working_set import PIN, ROD, STABLE, mass, rod_over_a_turn, weight

AREAS = [
    30.521806816,
    0.1,
    23.199887868,
    15.222906942,
    0.1,
    0.551355591,
    7.457200313,
    21.036427911,
    21.528441744,
    0.1,
]
ALONE = [7.937867966, 0.1, 8.062132034, 3.937867966, 0.1, 0.1, 5.744722215, 5.568986284, 5.568986284, 0.1]
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
    np.testing.assert_allclose(best.design, AREAS, atol=1e-3)
    price = np.max(best.limit("displacement").prices)
    np.testing.assert_allclose(price, 4882.979654308266 / 2.0, rtol=1e-4)
    np.testing.assert_allclose(best.bound_prices[[1, 4, 9]], [96.13038967, 229.178677, 220.9861134], atol=0.1)
    np.testing.assert_allclose(alone.design, ALONE, atol=0.01)
    strong = np.array([*[25e3] * 8, 75e3, 25e3])
    other = [mbs.Limit("stress", "stress", -strong, strong)]
    found = mbs.minimise(weight, np.full(10, 20.0), (0.1, None), limits=other, **INTERIOR)
    assert found.ok and found.value == pytest.approx(1497.6, rel=1e-6)


@pytest.mark.slow
def test_bounds_hold_an_optimum_from_a_little_inside():
    """The gear box of Golinski: the search ends some 1e-9 above a length's bound, which has a price all the same."""
    from benchmarks.machine_problems import MACHINES

    box = MACHINES["gear box"]
    limit, bounds = mbs.Limit("limits", box.c, upper=0.0, scale=1.0), (np.array(box.lower), np.array(box.upper))
    best = mbs.minimise(box.f, np.array(box.start), bounds, limits=limit, **INTERIOR)
    assert best.ok and best.value == pytest.approx(box.value, rel=1e-8)
    np.testing.assert_array_equal(np.flatnonzero(best.bound_prices), [1, 2, 3])


@pytest.mark.long
def test_ten_bars_with_frequencies_that_meet():
    """Case TB1: two modes have 20 Hz at the optimum and no gradient each, so that the verdict is not asked."""
    lower = np.array([7.0, 15.0, *np.full(6, 20.0)])
    best = mbs.minimise(mass, np.full(10, 20.0), (0.645, 50.0), limits=[mbs.Limit("f", "f", lower)], **INTERIOR)
    assert best.value == pytest.approx(532.0298092157224, rel=1e-6) and best.limit("f").ok
    pairs = [(35.63835, 0, 2), (14.91909, 1, 3), (24.06744, 6, 7), (12.58395, 8, 9)]
    for area, *bars in [*pairs, (0.645, 4), (4.62304, 5)]:
        np.testing.assert_allclose(best.design[np.array(bars)], area, atol=1e-3)
