"""Rainflow cycles: ASTM's printed example, case FA1, and the counters rainflow and fatpack."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs import fatigue

ASTM = np.array([-2.0, 1, -3, 5, -1, 3, -4, 4, -2])
LONG = np.array([-1.5, 1, -3, 10, -1, 3, -8, 4, -2, 6, -1, -4, -8, 2, 1, -5, 0, 2.5, -4, 1, 0, 2, -0.5], dtype=float)
I = np.arange(4000)  # noqa: E741
SIGNAL = 0.3 + np.sin(0.7 * I) + 0.6 * np.sin(1.93 * I + 1) + 0.3 * np.cos(4.1 * I)


def table(cycles):
    found = {}
    for size, count in zip(np.asarray(cycles.ranges), np.asarray(cycles.counts), strict=True):
        if count > 0:
            found[round(float(size), 9)] = found.get(round(float(size), 9), 0.0) + float(count)
    return found


def test_printed_tables():
    assert table(fatigue.rainflow(ASTM)) == {3: 0.5, 4: 1.5, 6: 0.5, 8: 1.0, 9: 0.5}
    assert table(fatigue.rainflow(LONG)) == {
        **{1: 1.0, 2.5: 1.0, 4: 1.5, 6: 1.5, 6.5: 0.5, 7: 1.0, 10.5: 0.5, 13: 0.5, 14: 1.0, 18: 0.5}
    }


@pytest.mark.parametrize("power, value", [(3, 9926.148039738602), (5, 86408.2165593432), (10, 26921520.54726465)])
def test_sums_over_a_signal(power, value):
    cycles = fatigue.rainflow(SIGNAL)
    np.testing.assert_allclose(np.sum(cycles.counts * cycles.ranges**power), value, rtol=1e-12)


def test_matrix_holds_every_cycle():
    cycles = fatigue.rainflow(SIGNAL)
    matrix = cycles.matrix(np.linspace(1e-9, 5, 11), np.linspace(-2, 3, 6))
    assert matrix.shape == (10, 5)
    np.testing.assert_allclose(matrix.sum(), np.sum(np.asarray(cycles.counts)[np.asarray(cycles.ranges) > 1e-9]))


def test_equal_and_monotone_samples_are_no_turning_points():
    dense = np.array([-2, -2, -1, 1, 1, 0, -3, -3, 2, 5, 5, -1, 0, 3, 1, -4, 4, 4, -2.0])
    assert table(fatigue.rainflow(dense)) == table(fatigue.rainflow(ASTM))
    assert table(fatigue.rainflow(np.ones(5))) == {}


@pytest.mark.long
def test_other_counters_agree():
    rainflow, fatpack = pytest.importorskip("rainflow"), pytest.importorskip("fatpack")
    rng = np.random.default_rng(5)
    signal = np.cumsum(rng.standard_normal(4000)) * 0.1 + rng.standard_normal(4000)
    ours = fatigue.rainflow(signal)
    theirs = np.array([(r, m, c) for r, m, c, _, _ in rainflow.extract_cycles(signal)])
    for k in (1, 4):
        np.testing.assert_allclose(np.sum(ours.counts * ours.ranges**k), np.sum(theirs[:, 2] * theirs[:, 0] ** k))
        np.testing.assert_allclose(
            np.sum(ours.counts * ours.means * ours.ranges**k), np.sum(theirs[:, 2] * theirs[:, 1] * theirs[:, 0] ** k)
        )
    reversals, _ = fatpack.find_reversals(signal, k=10_000)
    closed, residue = fatpack.find_rainflow_cycles(reversals)
    inner = np.sum(np.abs(np.diff(closed, axis=1)) ** 4)
    outer = 0.5 * np.sum(np.abs(np.diff(residue)) ** 4)
    np.testing.assert_allclose(np.sum(ours.counts * ours.ranges**4), inner + outer, rtol=1e-3)  # levels rounded


@pytest.mark.parametrize("traced", [False, True])
def test_every_range_of_a_decaying_oscillation_stays_open(traced):
    """Its residue is all of it: each range is half a cycle of its own."""
    fading = 0.99 ** np.arange(400) * (-1.0) ** np.arange(400)
    found = (jax.jit(fatigue.rainflow) if traced else fatigue.rainflow)(fading)
    kept = np.asarray(found.ranges)[np.asarray(found.counts) > 0]
    np.testing.assert_allclose(np.sort(kept)[::-1], np.abs(np.diff(fading)))
    assert np.sum(found.counts) == 399 / 2


def test_a_long_record_of_two_sines_with_a_long_residue():
    """500 periods of `1000 (sin 2 w t + sin w t)` sampled out of step with them: the ranges of each lie between the
    extremes at `cos w t = (-1 +- sqrt 33) / 8`; the larger ones begin and end at zero."""
    t = np.linspace(0.0, 1.0, 200_000)
    x = 1000 * np.sin(2000 * np.pi * t) + 1000 * np.sin(1000 * np.pi * t)
    u = np.arccos((-1 + np.array([1, -1]) * np.sqrt(33)) / 8)
    small, large = np.sort(np.abs(np.sin(2 * u) + np.sin(u)) ** 5)
    exact = ((499.5 + 1 / 32) * large + 500 * small) / 1e7  # and twice half of it, from zero
    np.testing.assert_allclose(fatigue.damage(x, fatigue.SN(1e7 * 1000.0**5, 5.0)), exact, rtol=2e-4)  # of samples


@pytest.mark.long
def test_batches_and_single_precision():
    batch = jnp.asarray(np.random.default_rng(1).standard_normal((3, 50)))
    together = jax.vmap(fatigue.rainflow)(batch)
    for k in range(3):
        alone = fatigue.rainflow(batch[k])
        np.testing.assert_allclose(np.sort(together.ranges[k]), np.sort(alone.ranges), rtol=1e-14)
    single = fatigue.rainflow(ASTM.astype(np.float32))
    assert single.ranges.dtype == np.float32 and table(single) == table(fatigue.rainflow(ASTM))


@pytest.mark.parametrize("signal", [np.ones((2, 2)), np.ones(1), np.array([1.0, np.nan])])
def test_signals_that_are_none(signal):
    with pytest.raises(ValueError, match="signal"):
        fatigue.rainflow(signal)
