"""A spring that yields: its loop, the work in it, and what it needs."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jaxmbs as mbs
from jaxmbs import forces as F

LAW = F.ElastoPlastic(1e4, 200.0, hardening=0.05, sharpness=3.0)


def driven(amplitude):
    """A block that is moved to and fro."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("block", mass=2.0)
    b.joint("x", mbs.Prismatic("x"), "ground", "block", drive=mbs.Harmonic(0.0, amplitude, 2.0 * np.pi))
    b.force("link", LAW, joint="x")
    return b.build()


@pytest.mark.long
@pytest.mark.parametrize("amplitude", [0.005, 0.1])
def test_work_of_a_loop(amplitude):
    """Energy lost in a turn, against SciPy; far beyond yield that of a perfectly sharp knee."""
    system = driven(amplitude)
    motion = mbs.simulate(system, mbs.State.at(system), ts=np.linspace(0.0, 3.0, 31))
    k, r, zy = 1e4, 0.05, 0.02

    def rates(t, y):
        v = amplitude * 2.0 * np.pi * np.cos(2.0 * np.pi * t)
        plastic = 0.5 * (abs(v) * y[0] + v * abs(y[0])) * abs(y[0] / zy) ** 2 / zy
        return [v - plastic, k * (1.0 - r) * y[0] * plastic]

    truth = solve_ivp(rates, (0.0, 3.0), [0.0, 0.0], rtol=1e-11, atol=1e-14, t_eval=[2.0, 3.0], max_step=1e-3).y
    work = motion.diagnostics.work["link"]
    np.testing.assert_allclose([work[20], work[30]], -truth[1], rtol=3e-6)
    if amplitude == 0.1:
        sharp = 4.0 * 200.0 * (1.0 - r) * (amplitude - zy)
        np.testing.assert_allclose(work[20] - work[30], sharp, rtol=0.05)


def test_elastic_below_and_hard_beyond():
    states = lambda z: {"elastic": jnp.asarray(z)}
    np.testing.assert_allclose(LAW.effort(0.001, 0.0, states(0.001), 0.0), -10.0)
    beyond = LAW.rate(0.0, 1.0, states(0.02), 0.0)["elastic"]
    back = LAW.rate(0.0, -1.0, states(0.02), 0.0)["elastic"]
    np.testing.assert_allclose([beyond, back], [0.0, -1.0], atol=1e-12)


def test_faults():
    messages = F.ElastoPlastic(-1.0, 0.0, 2.0, 1.0).faults()
    assert len(messages) == 4
