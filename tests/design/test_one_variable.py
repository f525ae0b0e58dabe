"""Kinks of one variable are found by few evaluations, at their closed forms, and smooth minima are none."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq

import jaxmbs as mbs

CROSSING = brentq(lambda x: np.exp(x) - 3 + 2 * x**3, 0.0, 1.0)
KINKS = {
    "absolute value": (lambda x: jnp.abs(x - 0.2) + 0.1 * (x - 0.5) ** 2, 0.2),
    "of bent sides": (lambda x: jnp.maximum(jnp.exp(x), 3 - 2 * x**3), CROSSING),
    "steep": (lambda x: 1e4 * jnp.abs(x - 0.3137) + x**2, 0.3137),
    "flat on one side": (lambda x: jnp.maximum(1e-2 * x, -5 * x**3 - x), 0.0),
    "with noise": (lambda x: jnp.abs(x - 0.2) + x**2 + 1e-9 * jnp.sin(1e7 * x), 0.2),
}
SMOOTH = {
    "rounded": (lambda x: jnp.sqrt((x - 0.2) ** 2 + 1e-10), 0.2),
    "steep valley": (lambda x: jnp.cosh(9 * (x - 0.2)) + x, 0.2 - np.arcsinh(1 / 9) / 9),
    "quartic": (lambda x: (x - 0.3) ** 4, 0.3),
}


def minimise(function, start, bounds=(-2.0, 2.0)):
    return mbs.minimise(lambda d: function(d["x"]), {"x": start}, {"x": bounds}, progress=False)


@pytest.mark.parametrize("start", [1.3, -1.1, 0.71])
@pytest.mark.parametrize("name", KINKS)
def test_kinks(name, start):
    function, place = KINKS[name]
    found = minimise(function, start)
    # of L-BFGS-B alone 36 to 92, which the flat one left at 0.003
    assert found.reason.startswith("a kink") and found.history.evaluations[-1] <= 40
    assert found.value - float(function(place)) <= 2e-8
    np.testing.assert_allclose(found.design["x"], place, atol=1e-6)


@pytest.mark.parametrize("start", [1.3, -1.1])
@pytest.mark.parametrize("name", SMOOTH)
def test_smooth_minima(name, start):
    function, place = SMOOTH[name]
    found = minimise(function, start)
    assert found.ok and found.value <= float(function(place)) + 1e-7
    assert "kink" not in found.reason


def test_beside_designs_without_values():
    """The bracket keeps to designs that have values."""
    found = minimise(lambda x: jnp.where(x < 0.1, jnp.nan, jnp.abs(x - 0.15)), 1.3)
    assert abs(found.design["x"] - 0.15) < 1e-7 and "kink" in found.reason
