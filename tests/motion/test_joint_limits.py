"""Limits of joints beside a motion: a pendulum whose extremes are known."""

import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.errors import ModelError, UnknownNameError
from jaxmbs.io import JointLimits


@pytest.fixture(scope="module")
def swing():
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("arm", mass=2.0, com=(0.5, 0, 0), inertia=np.diag([0.1, 0.3, 0.3]))
    b.joint("pin", mbs.Revolute("y"), "ground", "arm", drive=mbs.Harmonic(amplitude=0.5, omega=2.0))
    system = b.build()
    motion = mbs.simulate(system, mbs.State.at(system), ts=np.linspace(0.0, np.pi, 201))
    return system, motion, mbs.reactions(system, motion)


def test_within(swing):
    use = mbs.check(swing[0], swing[1], limits={"pin": JointLimits(-0.6, 0.6, 1.25, 2.0)}, efforts=swing[2])
    assert use.ok and use.faults() == []
    moment = 0.5 * 4 * (0.3 + 2 * 0.25)  # amplitude, square of 2 rad/s, inertia about the pin
    np.testing.assert_allclose(use.use["pin"], max(1.0 / 1.25, moment / 2.0), rtol=1e-6)
    assert "none passed" in repr(use)


@pytest.mark.parametrize(
    "limits, words",
    [
        (JointLimits(lower=-0.4), "passes its lower limit"),
        (JointLimits(upper=0.4), "passes its upper limit 0.4 rad, by 0.1, first at 0.4"),
        (JointLimits(velocity=0.9), "passes its limit of velocity 0.9 rad/s, by 0.1, first at 0 s"),
        (JointLimits(effort=1.0), "passes its limit of effort 1 N m, by 0.6"),
    ],
)
def test_beyond(swing, limits, words):
    use = mbs.check(swing[0], swing[1], limits={"pin": limits}, efforts={"pin": swing[2]["pin"].effort})
    assert not use.ok and words in use.faults()[0] and "FAILED" in repr(use)
    assert use.to_xarray()["pin"].attrs["units"] == "rad"


def test_unknown_joints_and_half_a_question(swing):
    with pytest.raises(UnknownNameError, match="'pim'"):
        mbs.check(swing[0], swing[1], limits={"pim": JointLimits()})
    with pytest.raises(ModelError, match="both motion= and limits="):
        mbs.check(swing[0], swing[1])
