"""Rotors behind a gear: reflected inertia, gyroscopic moment on the parent, reaction of the gear."""

import jax
import numpy as np
import pytest

import jaxmbs as mbs

ARM, ROTOR, RATIO, TORQUE = 0.5, 2e-3, 20.0, 3.0


def arm(rotor=ROTOR, like=None, kind=None, **place):
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("arm", mass=2.0, inertia=(ARM, ARM, ARM))
    b.joint("turn", mbs.Revolute("z") if kind is None else kind, "ground", "arm", **place)
    b.rotor("turn", rotor, RATIO)
    b.force("push", mbs.forces.PD(target=TORQUE, kp=1.0), joint="turn")
    return b.build(like=like)


@pytest.mark.parametrize(
    ("place", "inertia"),
    [
        ({}, ARM),
        ({"at": (0.3, 0.4, 0.0)}, ARM + 2.0 * 0.25),
        ({"kind": mbs.Prismatic("y")}, 2.0),
        ({"parent_frame": mbs.Pose((1.0, 0.0, 0.0), mbs.rotations.from_axis_angle("x", 0.7))}, ARM),
    ],
)
def test_the_joint_feels_its_inertia_times_the_square_of_the_ratio(place, inertia):
    system = arm(**place)
    u_dot = mbs.forward_dynamics(system, mbs.State.at(system))[0]
    np.testing.assert_allclose(u_dot[0], TORQUE / (inertia + RATIO**2 * ROTOR), rtol=1e-12)
    np.testing.assert_allclose(u_dot[1], RATIO * u_dot[0], rtol=1e-12)


@pytest.mark.slow
def test_the_gear_turns_the_rotor():
    """The coupler's effort on the joint is what turns the rotor, times the ratio; the base bears all three."""
    system = arm()
    state = mbs.State.at(system)
    loads, u_dot = mbs.reactions(system, state), mbs.forward_dynamics(system, state)[0]
    multiplier = mbs.forward_dynamics(system, state)[1]
    np.testing.assert_allclose(multiplier, [-ROTOR * RATIO * u_dot[0]], rtol=1e-10)
    assert loads.ok
    slope = jax.grad(lambda J: mbs.forward_dynamics(arm(J, like=system), state)[0][0])(ROTOR)
    np.testing.assert_allclose(slope, -TORQUE * RATIO**2 / (ARM + RATIO**2 * ROTOR) ** 2, rtol=1e-10)


@pytest.mark.slow
def test_its_parent_bears_its_gyroscopic_moment():
    """A turntable about x with an arm about z: the momentum of arm and rotor about z turns with it."""
    b, rate, spin = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0)), 0.7, 1.5
    b.body("table", mass=1.0, inertia=(0.1, 0.1, 0.1))
    b.body("arm", mass=1.0, inertia=(ARM, ARM, ARM))
    b.joint("base", mbs.Revolute("x"), "ground", "table")
    b.joint("turn", mbs.Revolute("z"), "table", "arm")
    b.rotor("turn", ROTOR, RATIO)
    system = b.build()
    state = mbs.State.at(system, velocities={"base": rate, "turn": spin})
    moment = mbs.reactions(system, state)["base"].moment
    expected = np.cross([rate, 0.0, 0.0], [0.0, 0.0, (ARM + ROTOR * RATIO) * spin])
    np.testing.assert_allclose(np.abs(moment), np.abs(expected), atol=1e-10)
    assert abs(float(mbs.forward_dynamics(system, state)[0][1])) < 1e-12


def test_faults():
    b = mbs.SystemBuilder()
    b.body("arm", mass=1.0, inertia=(1.0, 1.0, 1.0))
    b.rotor("turn", 1.0)
    b.joint("ball", mbs.Spherical(), "ground", "arm")
    b.rotor("ball", 1.0)
    b.joint("turn", mbs.Revolute("z"), "ground", "arm")
    b.rotor("turn", 0.0)
    b.rotor("turn", 1.0, 0.0)
    b.rotor("turn", np.nan, (1.0, 2.0))
    text = "\n".join(b.faults())
    for expected in (
        "rotor: there is no joint 'turn'",
        "must be Revolute or Prismatic, not Spherical",
        "inertia must be positive",
        "ratio must not be zero",
        "inertia must be finite",
        "ratio must be one number, got shape (2,)",
    ):
        assert expected in text, text
