"""A piston that crushes a chamber: the message of the failure names the pressure and the time."""

import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import forces as F


def ram(cushion=None):
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("ram", mass=1000.0)
    b.joint("slide", mbs.Prismatic("x"), "ground", "ram")
    law = F.HydraulicCylinder(
        (1e-3, 1e-3), (2e-4, 1e-4), 1e6, 0.0, 0.0, 1e5, leakage=1e-6, varying=True, end_cushion=cushion
    )
    b.force("boom", law, joint="slide")
    return b.build()


@pytest.mark.long
def test_a_chamber_that_vanishes_is_named():
    system = ram()
    state = mbs.State.at(system, velocities={"slide": 10.0})  # the chamber of 0.1 m in front is gone after 10 ms
    with pytest.raises(mbs.SimulationError) as found:
        mbs.simulate(system, state, t1=0.05, rtol=1e-6, atol=1e-6, max_steps=2000)
    text = str(found.value)
    assert "rates of internal states that are not finite by t = 0.01" in text and "boom.p1" in text, text
    assert "boom.p0" not in text and not found.value.motion.ok


@pytest.mark.long
def test_a_cushion_saves_the_chamber():
    """It stops the piston where its energy is that of the motion, which it gives back."""
    stop = mbs.BumpStop(4e8, upper=0.05)
    system = ram(stop)
    state = mbs.State.at(system, velocities={"slide": 3.0})
    motion = mbs.simulate(system, state, t1=0.05, rtol=1e-8, atol=1e-8)
    deepest = float(np.max(np.asarray(motion.states.coordinates)))
    assert motion.ok and abs(deepest - 0.05 - (3 * 0.5 * 1000.0 * 9.0 / 4e8) ** (1 / 3)) < 1e-3
    assert np.abs(motion.diagnostics.energy_residual).max() < 1e-5 * 4500.0
