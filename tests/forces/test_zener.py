"""The standard linear solid is a Prony series of one branch."""

import jax
import numpy as np

from jaxmbs import forces as F


def test_is_a_series_of_one_branch():
    k, c, k0 = 40.0, 3.0, 7.0
    zener, prony = F.Zener(k, c, k0, 0.1), F.Prony(k0, [k], [c / k], 0.1)
    for x, v, z in np.random.default_rng(0).normal(size=(5, 3)):
        of_one, of_series = {"stretch": z}, {"stretch": np.array([z])}
        for name in ("effort", "dissipated"):
            one, series = getattr(zener, name)(x, v, of_one, 0.0), getattr(prony, name)(x, v, of_series, 0.0)
            np.testing.assert_allclose(one, series)
        np.testing.assert_allclose(zener.potential(x, of_one, 0.0), prony.potential(x, of_series, 0.0))
        rates = zener.rate(x, v, of_one, 0.0)["stretch"], prony.rate(x, v, of_series, 0.0)["stretch"]
        np.testing.assert_allclose(rates[0], rates[1][0])
    slope = jax.grad(zener.potential)(0.3, {"stretch": 0.0}, 0.0)
    np.testing.assert_allclose(slope, -zener.effort(0.3, 0.0, {"stretch": 0.0}, 0.0))


def test_faults():
    assert F.Zener(1.0, 1.0, -1.0).faults() == ["static_stiffness must not be negative"]
