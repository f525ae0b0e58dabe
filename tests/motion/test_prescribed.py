"""Whether a start has a freedom: a mechanism whose branches have not the same, and one that is driven through a
singular pose."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jaxmbs as mbs
from tests.models import PIN

G, RADIUS, BAR = 9.81, 0.3, 2.0
PARALLEL = {"foot 1": 0.7, "foot 2": 0.7, **{f"head {k}": -0.7 for k in range(3)}}
CRANK, FOOT = {"parent_frame": (RADIUS, 0, 0)}, {"foot 0": 0.7}


def cranks(mass=1.0, speed=None, like=None):
    """A bar on three cranks: free where these are parallel, and a structure where one of them crosses, as next to the
    reference pose, in which all lie along a line."""
    b = mbs.SystemBuilder(gravity=(0.0, -G, 0.0))
    b.body("bar", BAR, com=(0.5, 0, 0), inertia=mbs.inertia.rod(BAR, 1.0))
    for k in range(3):
        b.body(f"crank {k}", mass, com=(RADIUS / 2, 0, 0), inertia=mbs.inertia.rod(mass, RADIUS))
        b.joint(f"foot {k}", PIN, "ground", f"crank {k}", parent_frame=(0.5 * k, 0, 0))
        b.joint(f"head {k}", PIN, f"crank {k}", "bar", child_frame=(0.5 * k, 0, 0), **CRANK)
    if speed is not None:
        b.body("wheel", 1.0, inertia=0.1)
        b.joint("hub", PIN, "ground", "wheel", drive=mbs.Ramp(0.0, speed))
    return b.build(like=like)


def fall(rate, times):
    """Angle of the cranks, which turn as one, by SciPy."""
    inertia, weight = (1.0 + BAR) * RADIUS**2, (1.5 + BAR) * G * RADIUS
    slope = lambda t, y: [y[1], -weight * np.cos(y[0]) / inertia]
    return solve_ivp(slope, (0.0, times[-1]), [0.7, rate], "DOP853", times, rtol=1e-12, atol=1e-12).y[0]


@pytest.mark.slow
@pytest.mark.parametrize("rate", [0.0, 2.0])
def test_a_branch_with_a_freedom_of_its_own(rate):
    system, times = cranks(), np.linspace(0.1, 0.5, 5)
    assert system.topology.mobility == 0

    def motion(mass):
        system_here = cranks(mass, like=system)
        state = mbs.State.at(system_here, FOOT, guess=PARALLEL, velocities={"foot 0": rate})
        return mbs.simulate(system_here, state, ts=times, throw=False)

    with pytest.warns(UserWarning, match="mobility 1 at this pose"):
        known = motion(1.0)
    traced = mbs.jit(motion)(1.0)
    for found in (known, traced):
        assert found.ok
        np.testing.assert_allclose(found.states.coordinates[:, 0], fall(rate, times), atol=1e-6)
    with pytest.raises(mbs.ModelError, match="leave 1 freedoms open"), pytest.warns(UserWarning, match="mobility"):
        mbs.simulate(system, mbs.State.at(system, FOOT, guess=PARALLEL), t1=0.1, formulation="prescribed")


@pytest.mark.slow
@pytest.mark.parametrize("rate", [0.0, 2.0])
def test_a_start_that_is_free_where_the_drives_leave_nothing_open(rate):
    """A wheel beside the cranks is driven.  Traced, the count of the build holds: the status says so."""
    first = cranks(speed=3.0)

    def motion(speed):
        system = cranks(speed=speed, like=first)
        state = mbs.State.at(system, FOOT, guess=PARALLEL, velocities={"foot 0": rate})
        return mbs.simulate(system, state, t1=0.1, throw=False)

    assert mbs.jit(motion)(3.0).status == mbs.status.Status.INCONSISTENT
    with pytest.warns(UserWarning, match="mobility 1 at this pose"):
        known = motion(3.0)
    angle = first.coordinates(known.end)["foot 0"]
    np.testing.assert_allclose(angle, fall(rate, np.array([0.05, 0.1]))[-1], atol=1e-6)


@pytest.mark.long
def test_a_turn_from_a_singular_pose_to_itself():
    """Two equal cranks that are driven through the pose in which all lies along a line, where it begins and ends."""

    def build(length, like=None):
        b = mbs.SystemBuilder()
        b.body("left", 1.0, com=(0.1, 0, 0), inertia=0.1)
        b.body("right", 1.0, com=(0.1, 0, 0), inertia=0.1)
        b.body("bar", 1.0, com=(0.5, 0, 0), inertia=0.1)
        b.joint("left foot", PIN, "ground", "left", drive=drive)
        b.joint("right foot", PIN, "ground", "right", parent_frame=(1.0, 0, 0))
        b.joint("left head", PIN, "left", "bar", parent_frame=(length, 0, 0))
        b.joint("right head", PIN, "right", "bar", parent_frame=(length, 0, 0), child_frame=(1.0, 0, 0))
        return b.build(like=like, guess={"left foot": 0.7, "right foot": 0.7, "left head": -0.7})

    drive = mbs.Harmonic(np.pi, np.pi, 2 * np.pi, -np.pi / 2)  # at rest at both ends
    first = build(0.2)

    def motion(length):
        system = build(length, like=first)
        return mbs.simulate(system, mbs.State.at(system), ts=np.linspace(0.0, 0.5, 6), throw=False)

    found = mbs.jit(motion)(0.2)
    assert found.ok, found.status
