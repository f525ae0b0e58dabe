"""Flow and torque of a pump."""

import jax.numpy as jnp
import numpy as np

from jaxmbs import hydraulics as H


def test_power_of_the_shaft_is_that_of_the_oil_without_leakage():
    pump = H.Pump(displacement=1e-5, leakage=2e-12)
    flow = pump.output(jnp.array([1e5, 2e7, 150.0]), {}, 0.0)
    np.testing.assert_allclose(flow, 1e-5 * 150.0 - 2e-12 * 1.99e7)
    ideal = H.Pump(1e-5)
    np.testing.assert_allclose(ideal.torque(-1.99e7) * 150.0, ideal.flow(-1.99e7, 150.0) * 1.99e7)


def test_faults():
    assert len(H.Pump(0.0, -1.0).faults()) == 2
