"""A gas spring: its law, its energy, and the end of its gas."""

import jax
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import forces as F

LAW = F.AirSpring(2e-3, 6e5, 0.15, exponent=1.3, length=0.4)


def test_effort_is_the_slope_of_the_energy():
    for x in (0.3, 0.4, 0.55):
        np.testing.assert_allclose(LAW.effort(x, 0.0, 0.0), -jax.grad(LAW.potential)(x, 0.0), rtol=1e-12)
    np.testing.assert_allclose(LAW.effort(0.4, 0.0, 0.0), 2e-3 * (6e5 - 101325.0))
    np.testing.assert_allclose(LAW.potential(0.4, 0.0), 0.0)


@pytest.mark.long
def test_a_mass_on_it_keeps_its_energy_and_stops_before_the_end():
    b = mbs.SystemBuilder()
    b.body("mass", mass=80.0)
    b.joint("lift", mbs.Prismatic("z"), "ground", "mass")
    b.force("air", LAW, joint="lift")
    system = b.build()
    motion = mbs.simulate(system, mbs.State.at(system, lift=0.4, velocities={"lift": -1.0}), t1=1.0)
    assert motion.ok and np.abs(motion.diagnostics.energy_residual).max() < 1e-7
    beyond = mbs.simulate(system, mbs.State.at(system, lift=0.2), t1=0.1, throw=False)
    assert not beyond.ok


def test_faults():
    assert len(F.AirSpring(0.0, 0.0, 0.0, 1.0, -1.0).faults()) == 5
