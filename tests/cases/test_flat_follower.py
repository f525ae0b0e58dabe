"""CT2, a flat follower on an eccentric: the force at the top, and the speed at which it lifts off."""

import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.contact import HuntCrossley, SphereOnPlane
from tests.models import rotation_about

E, MASS, SPRING, PRELOAD, LIFT_OFF = 0.01, 0.8, 6000.0, 40.0, 141.4213562373095
FORCES = {50.0: 140.0, 100.0: 80.0}  # speed [rad/s]: force at the top [N]
STIFFNESS, RADIUS = 1e8, 0.03


def follower(omega):
    """The eccentric's centre starts at the bottom, its face on the follower's, which looks down."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("cam", 1.0, inertia=(1e-3, 1e-3, 1e-3))
    b.joint("cam", mbs.Revolute("y"), "ground", "cam", drive=mbs.Ramp(0.0, omega))
    b.body("follower", MASS)
    b.joint("lift", mbs.Prismatic("z"), "ground", "follower")
    b.force("spring", mbs.SpringDamper(SPRING, free_length=-E, preload=PRELOAD), joint="lift")
    face = ("follower", mbs.Pose((0.0, 0.0, RADIUS), rotation_about((1, 0, 0), np.pi)))
    force = HuntCrossley(STIFFNESS, 1.0, damping=20.0)
    b.contact("face", SphereOnPlane(RADIUS), ("cam", (0.0, 0.0, -E)), face, force)
    return b.build()


@pytest.mark.long
def test_force_at_the_top_and_lift_off():
    for omega in (50.0, 100.0, 0.97 * LIFT_OFF, 1.03 * LIFT_OFF):
        system = follower(omega)
        depth = (PRELOAD + MASS * E * omega**2) / STIFFNESS
        start = mbs.State.at(system, {"lift": -E - depth})
        ts = np.linspace(0.0, 1.3 * np.pi, 261)[1:] / omega
        motion = mbs.simulate(system, start, ts=ts, rtol=1e-9, atol=1e-11, max_steps=200_000)
        force = np.asarray(mbs.dynamics.contact_load(system, motion, "face").normal_force)[:, 0]
        if omega in FORCES:
            top = np.interp(np.pi / omega, ts, force)
            np.testing.assert_allclose(top, FORCES[omega], rtol=2e-3)
        assert (force.min() == 0.0) == (omega > LIFT_OFF)
