"""Gas of an accumulator."""

import jax
import numpy as np
import pytest
from scipy.integrate import quad

from jaxmbs import hydraulics as H

ATMOSPHERE = 101325.0
GAS = H.Accumulator(volume=2e-3, precharge=5e6, exponent=1.3, dead_volume=1e-9)


def test_gas_follows_its_polytropic_law():
    p = 9e6
    np.testing.assert_allclose((p + ATMOSPHERE) * GAS.gas_volume(p) ** 1.3, (5e6 + ATMOSPHERE) * 2e-3**1.3)
    np.testing.assert_allclose(GAS.capacity(p), -jax.grad(GAS.gas_volume)(p), rtol=1e-5)


def test_oil_taken_up_is_the_gas_volume_lost():
    oil = quad(lambda p: float(GAS.capacity(p)), 5.01e6, 9e6, epsrel=1e-8)[0]
    np.testing.assert_allclose(oil, GAS.gas_volume(5.01e6) - GAS.gas_volume(9e6), rtol=1e-5)
    np.testing.assert_allclose(GAS.rate(1e-4, {"p": 9e6}, 0.0)["p"], 1e-4 / GAS.capacity(9e6))


def test_below_the_precharge_only_the_oil_gives_way():
    assert GAS.start(0.0, 0.0)["p"] == 5e6
    np.testing.assert_allclose(GAS.capacity(4.9e6), 1e-9 / 1.4e9)
    assert np.isfinite(jax.grad(GAS.capacity)(-1e6))


@pytest.mark.parametrize("name", ["volume", "precharge", "exponent", "ambient"])
def test_slopes_of_the_capacity(name):
    def scaled(value):
        return 1e9 * H.Accumulator(**(vars(GAS) | {name: value})).capacity(9e6)

    value = float(getattr(GAS, name))
    h = 1e-5 * value
    np.testing.assert_allclose(jax.grad(scaled)(value), (scaled(value + h) - scaled(value - h)) / (2 * h), rtol=1e-6)


def test_faults():
    assert len(H.Accumulator(0.0, -1.0, 0.5, None, 0.0, 0.0, 0.0, 0.0).faults()) == 7
