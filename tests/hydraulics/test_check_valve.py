"""A valve of one direction."""

import jax
import numpy as np

from jaxmbs import hydraulics as H


def test_it_opens_in_one_direction():
    valve = H.CheckValve(rated_flow=1e-3, rated_drop=5e5, cracking=1e5)
    np.testing.assert_allclose(valve.flow(6e5), 1e-3)
    assert valve.flow(8e4) == valve.flow(-1e7) == 0.0
    h = 1.0
    for drop in (9.5e4, 1.05e5, 2e5):
        by_differences = (valve.flow(drop + h) - valve.flow(drop - h)) / (2 * h)
        np.testing.assert_allclose(jax.grad(valve.flow)(drop), by_differences, rtol=1e-6)


def test_faults():
    assert len(H.CheckValve(0.0, 0.0, -1.0, 0.0).faults()) == 4
