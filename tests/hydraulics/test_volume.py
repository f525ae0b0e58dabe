"""A volume of oil, and a tank."""

import jax.numpy as jnp
import numpy as np

from jaxmbs import hydraulics as H


def test_pressure_rises_with_the_flow_into_it():
    volume = H.Volume(1e-3, 1.2e9, pressure=2e6)
    assert volume.start(0.0, 0.0)["p"] == volume.output(0.0, {"p": volume.pressure}, 0.0) == 2e6
    np.testing.assert_allclose(volume.rate(1e-5, {"p": 2e6}, 0.0)["p"], 1.2e9 * 1e-5 / 1e-3)
    np.testing.assert_allclose(volume.stored(2e6), 0.5 * 1e-3 / 1.2e9 * 4e12)
    assert len(H.Volume(0.0, 0.0).faults()) == 2


def test_a_tank_keeps_its_pressure():
    tank = H.Tank(1e5)
    assert tank.output(jnp.ones(()), {}, 0.0) == 1e5 and not tank.internal_states
