"""Miner's sum: case FA1 with its gradient, mean corrections, equivalent loads."""

import jax
import numpy as np
import pytest

from jaxmbs import fatigue
from jaxmbs.fatigue import SN, damage, equivalent_load

from .test_cycles import ASTM, SIGNAL

SLOPE_OF = np.array([-2, 1.1, -3, 5, -1, 3.05, -4, 4, -2.2])
GRADIENT = [
    *(-190.91440242288874, 837.1915456466278, -10953.012687054936, 38931.79742675164, -1563.2162847608815),
    *(1936.7281404117116, -22512.0197066012, 17693.171970041054, -3895.6194378674277),
]
FIFTH = SN(1.0, 5.0, ranges=True)


@pytest.mark.long
def test_goodman_and_its_gradient():
    np.testing.assert_allclose(damage(ASTM, FIFTH, "goodman", 20.0), 77923.40114824969, rtol=1e-12)
    gradient = jax.jit(jax.grad(lambda x: damage(x, FIFTH, "goodman", 20.0)))(SLOPE_OF)
    np.testing.assert_allclose(gradient, GRADIENT, rtol=1e-9)


def one(amplitude, mean):
    """A history of one cycle: two halves."""
    return np.array([mean - amplitude, mean + amplitude, mean - amplitude])


@pytest.mark.parametrize(
    "mean, amplitude",
    [(None, 2.0), ("goodman", 2 / (1 - 3 / 10)), ("gerber", 2 / (1 - 0.09)), ("swt", np.sqrt(5 * 2.0))],
)
def test_corrections_in_tension(mean, amplitude):
    ultimate = 10.0 if mean in ("goodman", "gerber") else None
    np.testing.assert_allclose(damage(one(2, 3), SN(1e6, 4.0), mean, ultimate), amplitude**4 / 1e6, rtol=1e-12)


@pytest.mark.long
def test_corrections_in_compression():
    sn = SN(1e6, 4.0)
    np.testing.assert_allclose(damage(one(2, -3), sn, "goodman", 10.0), (2 / 1.3) ** 4 / 1e6)
    np.testing.assert_allclose(damage(one(2, -3), sn, "gerber", 10.0), 16 / 1e6)
    assert damage(one(2, -3), sn, "swt") == 0
    slope = jax.grad(lambda x: damage(x, sn, "swt"))(one(2.0, -3.0))
    assert np.all(np.isfinite(slope))


@pytest.mark.parametrize("mean", ["goodman", "gerber"])
def test_a_mean_at_the_ultimate_is_infinite_damage(mean):
    assert np.isinf(damage(one(1, 10), SN(1e6, 4.0), mean, 10.0))
    assert np.isfinite(damage(one(1, 9), SN(1e6, 4.0), mean, 10.0))


def test_residue_is_half_cycles():
    np.testing.assert_allclose(damage(np.array([-2.0, 2.0]), SN(1e6, 4.0)), 0.5 * 16 / 1e6)


def test_amplitudes_and_ranges():
    np.testing.assert_allclose(damage(ASTM, SN(1e6, 3.0)) * 8, damage(ASTM, SN(1e6, 3.0, ranges=True)))


@pytest.mark.long
def test_equivalent_load():
    np.testing.assert_allclose(equivalent_load(ASTM, 3.0, 4.0, ranges=True), (1094.0 / 4) ** (1 / 3), rtol=1e-12)
    np.testing.assert_allclose(2 * equivalent_load(ASTM, 3.0), equivalent_load(ASTM, 3.0, ranges=True))
    assert equivalent_load(np.ones(4), 3.0) == 0
    assert np.all(np.isfinite(jax.grad(lambda x: equivalent_load(x, 3.0))(np.ones(4))))


@pytest.mark.long
def test_gradient_by_curve_and_history():
    def total(p):
        sn = SN(p[0] * 1e5, p[1], p[2], p[3], p[4])
        return damage(p[5] * SIGNAL[:40], sn, "gerber", p[6])

    p = np.array([2.0, 3.1, 0.83, 5.2, 0.11, 1.3, 9.0])
    gradient = jax.grad(total)(p)
    for k in range(7):
        h = 1e-6 * np.eye(7)[k]
        np.testing.assert_allclose(gradient[k], (total(p + h) - total(p - h)) / 2e-6, rtol=2e-6, atol=1e-16)


@pytest.mark.parametrize(
    "options", [{"mean": "morrow"}, {"mean": "goodman"}, {"mean": "swt", "ultimate": 3.0}, {"ultimate": 3.0}]
)
def test_wrong_corrections(options):
    with pytest.raises(ValueError, match="mean"):
        damage(ASTM, FIFTH, **options)


def test_cycles_stand_for_their_history():
    np.testing.assert_allclose(damage(fatigue.rainflow(ASTM), FIFTH), damage(ASTM, FIFTH))
