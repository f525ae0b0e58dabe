"""Springs and dampers by polynomials, against NumPy, with a range at rest."""

import jax
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.forces import PolynomialSpring

LAW = PolynomialSpring([5.0, 2.0, 3.0], [0.4, 0.2, 0.1], lower=-0.1, upper=0.3)


@pytest.mark.parametrize(("x", "v"), [(0.5, 0.7), (-0.4, -0.6), (0.1, 0.3), (0.3, 0.0)])
def test_effort_and_potential(x, v):
    d = x - np.clip(x, -0.1, 0.3)
    wanted = -(5 * d + 2 * d**2 + 3 * d**3) - (0.4 * v + 0.2 * abs(v) * v + 0.1 * v**3)
    np.testing.assert_allclose(LAW.effort(x, v, 0.0), wanted, rtol=1e-13)
    np.testing.assert_allclose(LAW.potential(x, 0.0), 5 * d**2 / 2 + 2 * d**3 / 3 + 3 * d**4 / 4, rtol=1e-13)
    np.testing.assert_allclose(jax.grad(LAW.potential)(x, 0.0), -LAW.effort(x, 0.0, 0.0), atol=1e-13)


def test_faults():
    assert LAW.stores and LAW.dissipates and not PolynomialSpring([1.0]).dissipates
    assert PolynomialSpring([1.0], [-1.0]).faults() == ["damping must not be negative"]
    assert PolynomialSpring([1.0], lower=1.0).faults() == ["lower must not exceed upper"]
    b = mbs.SystemBuilder()
    b.force("spring", PolynomialSpring(3.0), joint="pin")
    assert any("rows of coefficients" in fault for fault in b.faults())
