"""Discharge of an orifice."""

import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp

from jaxmbs import hydraulics as H

ORIFICE = H.Orifice(area=2e-6, discharge=0.65, density=850.0)


def test_discharge_follows_the_root_of_the_pressure_difference():
    flow = ORIFICE.output(jnp.array([9e6, 1e6]), {}, 0.0)
    np.testing.assert_allclose(flow, 0.65 * 2e-6 * np.sqrt(2 * 8e6 / 850.0), rtol=1e-5)
    np.testing.assert_allclose(ORIFICE.output(jnp.array([1e6, 9e6]), {}, 0.0), -flow)


def test_flow_is_smooth_through_zero():
    slope = jax.grad(ORIFICE.flow)
    np.testing.assert_allclose(slope(0.0), 0.65 * 2e-6 * np.sqrt(2 / 850.0 / 1e4), rtol=1e-12)
    h = 10.0
    np.testing.assert_allclose(slope(3e3), (ORIFICE.flow(3e3 + h) - ORIFICE.flow(3e3 - h)) / (2 * h), rtol=1e-6)


def test_a_signal_opens_it():
    u = jnp.array([9e6, 1e6, 0.25])
    np.testing.assert_allclose(ORIFICE.output(u, {}, 0.0), 0.25 * ORIFICE.output(u[:2], {}, 0.0))
    assert ORIFICE.output(u.at[2].set(-0.5), {}, 0.0) == 0.0


def test_a_volume_empties_through_it_in_the_time_of_torricelli():
    """`sqrt(p)` falls linearly: `sqrt(p0) - sqrt(p) = K E t / (2 V)`."""
    volume = H.Volume(1e-3, 1.2e9)

    def rate(t, p):
        return np.asarray(volume.rate(-ORIFICE.flow(p[0]), {"p": p[0]}, t)["p"])[None]

    p0, t = 1e7, 2e-3
    found = solve_ivp(rate, (0.0, t), [p0], rtol=1e-8, atol=1.0).y[0, -1]
    gain = 0.65 * 2e-6 * np.sqrt(2 / 850.0) * 1.2e9 / 1e-3
    np.testing.assert_allclose(found, (np.sqrt(p0) - gain * t / 2) ** 2, rtol=1e-5)


def test_faults():
    assert len(H.Orifice(-1.0, 1.5, 0.0, 0.0).faults()) == 4
    assert not ORIFICE.faults()
