"""Bevel gears against the forces of the textbook, their energy, and their slopes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.forces import BevelGear, PathKinematics
from tests.differences import check_slopes

ALPHA, STIFFNESS = np.radians(20.0), 1e7
STILL = jnp.zeros((2, 3))


def about(axis, angle):
    """Rotation by an angle about x, y or z."""
    i, j = (("x", 1, 2), ("y", 2, 0), ("z", 0, 1))["xyz".index(axis)][1:]
    c, s = jnp.cos(angle), jnp.sin(angle)
    return jnp.eye(3).at[i, i].set(c).at[j, j].set(c).at[i, j].set(-s).at[j, i].set(s)


def poses(a, b, shaft):
    """A about z; B about an axis in the plane of x and z, at an angle to z; x axes point to the other wheel."""
    tilted = about("y", shaft)  # z to the axis of B, x away from the axis of A
    return jnp.stack([about("z", a), tilted @ about("z", jnp.pi + b)])


@pytest.mark.long
@pytest.mark.parametrize("shaft", [np.pi / 2, 1.2])
def test_forces_of_the_textbook(shaft):
    law = BevelGear((20, 40), 2e-3, ALPHA, STIFFNESS, transition=1e-9)
    force, moment = law.wrench(PathKinematics(poses(1e-4, 0.0, shaft), STILL, STILL, STILL), 0.0)
    tangential = STIFFNESS * 0.02 * np.cos(ALPHA) * 1e-4 * np.cos(ALPHA)
    cone = np.arctan2(np.sin(shaft), 2.0 + np.cos(shaft))
    radial, axial = tangential * np.tan(ALPHA) * np.array([np.cos(cone), np.sin(cone)])
    np.testing.assert_allclose(force[0], [-radial, -tangential, axial], rtol=1e-8)
    np.testing.assert_allclose(force[1], -force[0], rtol=1e-12)
    axis, across = (np.array([np.sin(shaft), 0, np.cos(shaft)]), np.array([np.cos(shaft), 0, -np.sin(shaft)]))
    other = shaft - cone  # cone angle of B
    np.testing.assert_allclose(force[1] @ axis, tangential * np.tan(ALPHA) * np.sin(other), rtol=1e-8)
    np.testing.assert_allclose(force[1] @ across, tangential * np.tan(ALPHA) * np.cos(other), rtol=1e-8)
    np.testing.assert_allclose([moment[0, 2], moment[1] @ axis], [-0.02 * tangential, -0.04 * tangential], rtol=1e-8)


@pytest.mark.long
def test_wheels_turn_many_times_against_each_other_and_have_play():
    law = BevelGear((20, 40), 2e-3, ALPHA, STIFFNESS, backlash=1e-5, transition=1e-9)
    turns = 2 * np.pi * np.array([7 + 3 / 20, -(3 + 23 / 40)])
    for extra, pressed in ((0.0, False), (0.99e-5, False), (1.01e-5, True), (-1.01e-5, True)):
        angle = turns[0] + extra / 2 / 0.02 / np.cos(ALPHA)
        force, _ = law.wrench(PathKinematics(poses(angle, turns[1], 1.3), STILL, STILL, STILL), 0.0)
        assert (np.abs(force).max() > 0.1) == pressed


@pytest.mark.long
def test_effort_is_minus_the_derivative_of_the_energy():
    law = BevelGear((20, 40), 2e-3, ALPHA, STIFFNESS, backlash=2e-5)

    def at(p):
        return poses(p[0], p[1], 1.3), jnp.stack([jnp.zeros(3), p[2:]])

    start = jnp.array([2e-3, 0.0, 1e-5, 2e-5, 3e-5])
    force, moment = law.wrench(PathKinematics(*at(start), STILL, STILL), 0.0)
    assert np.abs(force).max() > 1.0
    slope = -jax.grad(lambda p: law.potential(*at(p), 0.0))(start)
    axis = np.array([np.sin(1.3), 0.0, np.cos(1.3)])
    np.testing.assert_allclose(slope[2:], force[1], rtol=1e-6)
    # both feel the force at one point, so that arms differ by the shifts of the apexes
    np.testing.assert_allclose(slope[:2], [moment[0, 2], moment[1] @ axis], rtol=2e-3)


@pytest.mark.long
def test_slopes_against_differences():
    home = {"module": 2e-3, "pressure_angle": ALPHA, "stiffness": 1e7, "backlash": 1e-5, "damping": 100.0}
    spin = jnp.array([[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])

    def torque(values):
        law = BevelGear((20, 40), **values, transition=1e-9)
        return law.wrench(PathKinematics(poses(3e-3, 0.0, 1.3), STILL, spin, STILL), 0.0)[1][0, 2]

    check_slopes(torque, home)


def test_faults():
    for law, message in (
        (BevelGear((20, 0), 2e-3), "whole numbers from 1"),
        (BevelGear((20, 40), 2e-3, 1.0), "between 0 and pi/4"),
        (BevelGear((20, 40), 2e-3, backlash=1e-2), "half a tooth pitch"),
    ):
        assert any(message in fault for fault in law.faults()), message


@pytest.mark.long
def test_bearings_carry_the_forces():
    shaft = np.pi / 2
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    frame = mbs.Pose((0, 0, 0), np.asarray(about("y", shaft)))
    for name, parent_frame in (("pinion", (0, 0, 0)), ("wheel", frame)):
        b.body(name, 1.0, inertia=0.01)
        b.joint(name, mbs.Revolute("z"), "ground", name, parent_frame=parent_frame)
    law = BevelGear((20, 40), 2e-3, ALPHA, STIFFNESS, phase=40 * np.pi)
    b.force("mesh", law, between=("pinion", "wheel"))
    system = b.build()
    loads = mbs.reactions(system, mbs.State.at(system, pinion=1e-4, wheel=np.pi))
    force, _ = law.wrench(PathKinematics(poses(1e-4, 0.0, shaft), STILL, STILL, STILL), 0.0)
    np.testing.assert_allclose(loads["pinion"].force, -force[0], rtol=1e-8)
    np.testing.assert_allclose(loads["wheel"].force, -force[1], rtol=1e-8)
