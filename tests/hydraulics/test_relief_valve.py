"""A pump against a relief valve."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxmbs import hydraulics as H

RELIEF = H.ReliefValve(cracking=1.8e7, slope=2e-9)


def test_closed_below_and_linear_above_its_cracking_pressure():
    assert RELIEF.flow(1.79e7) == 0.0
    np.testing.assert_allclose(RELIEF.output(jnp.array([2e7, 1e6]), {}, 0.0), 2e-9 * 1e6)
    slope = jax.grad(RELIEF.flow)
    assert slope(1.79e7) == 0.0
    np.testing.assert_allclose([slope(1.8e7), slope(1.81e7)], [1e-9, 2e-9])


def test_pump_and_relief_valve_settle_at_their_common_pressure():
    """`D w - leakage p = slope (p - cracking)`."""
    pump, volume, speed = H.Pump(displacement=1e-5, leakage=1e-12), H.Volume(2e-4), 150.0

    def rate(p):
        return volume.rate(pump.flow(-p, speed) - RELIEF.flow(p), {"p": p}, 0.0)["p"]

    p = 1.9e7
    for _ in range(3):
        p = p - rate(p) / jax.grad(rate)(p)
    np.testing.assert_allclose(p, (1e-5 * speed + 2e-9 * 1.8e7) / (2e-9 + 1e-12), rtol=1e-12)
    np.testing.assert_allclose(pump.torque(-p), 1e-5 * p)


def test_faults():
    assert len(H.ReliefValve(-1.0, 0.0, 0.0).faults()) == 3
