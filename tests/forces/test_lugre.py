"""Bristles: steady sliding, heat, and refusals; the case FR3 has their motion."""

import numpy as np

from jaxmbs import forces as F

LAW = F.LuGre(2.0, 1e5, 300.0, static_ratio=1.5, viscous=0.4, stribeck_speed=1e-2)


def test_steady_sliding_is_the_stribeck_curve():
    for v in (-0.5, -0.003, 0.003, 0.02, 1.0):
        limit = 2.0 * (1.0 + 0.5 * np.exp(-((v / 1e-2) ** 2)))
        s = {"bristle": np.sign(v) * limit / 1e5}
        np.testing.assert_allclose(LAW.rate(0.0, v, s, 0.0)["bristle"], 0.0, atol=1e-12)
        np.testing.assert_allclose(LAW.effort(0.0, v, s, 0.0), -np.sign(v) * limit - 0.4 * v, rtol=1e-9)
        np.testing.assert_allclose(LAW.dissipated(0.0, v, s, 0.0), limit * abs(v) + 0.4 * v**2, rtol=1e-9)


def test_it_holds_at_rest():
    np.testing.assert_allclose(LAW.effort(0.0, 0.0, {"bristle": 1e-5}, 0.0), -1.0)


def test_faults():
    assert len(F.LuGre(0.0, 0.0, -1.0, 0.5, -1.0, 0.0).faults()) == 6
