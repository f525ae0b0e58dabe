"""Friction of a door on two hinges: equal compliances share its load, by a closed form, as `reactions` have it."""

import jax
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.friction import SmoothCoulomb

MASS, LEVER, INERTIA, GRAVITY, SPEED, MU = 20.0, 0.4, 1.0, 9.81, 2.0, 0.3
#: Distance of the hinges, height of the centre of mass over the lower one, and radii of the pins [m].
SPAN, HEIGHT, RADII = 1.2, 0.9, (0.05, 0.02)


def door(mu=MU, solver="auto", like=None, handle=0.0):
    """A door whose axis is level, on two hinges; part of its mass is a handle that is welded to it."""
    b = mbs.SystemBuilder(gravity=(0, -GRAVITY, 0))
    b.body("door", mass=MASS - handle, com=(LEVER, 0, HEIGHT), inertia=(1.0, 1.0, INERTIA))
    if handle:
        b.body("handle", mass=handle, com=(LEVER, 0, HEIGHT))
        b.joint("weld", mbs.joints.Weld(), "door", "handle")
    for name, at, radius in (("near", 0.0, RADII[0]), ("far", SPAN, RADII[1])):
        b.joint(name, mbs.Revolute("z"), "ground", "door", parent_frame=(0, 0, at), child_frame=(0, 0, at))
        b.friction(f"rub {name}", name, SmoothCoulomb(mu, transition_speed=1e-4), radius=radius)
    return b.build(linear_solver=solver, like=like)


def closed_form(length, mu=MU):
    """Acceleration of the door, loads of both hinges.

    Both take the same moment; the least of `F1^2 + F2^2 + (M1^2 + M2^2) / length^2` gives the share of the far one,
    equal for the two directions of the force, so that only its size depends on the friction.
    """
    share = (2.0 + SPAN * HEIGHT / length**2) / (4.0 + (SPAN / length) ** 2)
    shares, a = np.array([1.0 - share, share]), 0.0
    for _ in range(60):
        loads = shares * MASS * np.hypot(LEVER * SPEED**2, LEVER * a + GRAVITY)
        torque = -MASS * GRAVITY * LEVER - mu * loads @ RADII
        a = torque / (INERTIA + MASS * LEVER**2)
    return a, loads


def state_of(system):
    inside = next(iter(system.coordinates(mbs.State.at(system))))
    return mbs.State.at(system, velocities={inside: SPEED})


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:friction of joint")
@pytest.mark.parametrize("solver", ["dense", "multifrontal"])
def test_loads_of_friction_are_those_of_reactions_and_of_the_closed_form(solver):
    system = door(solver=solver)
    state = state_of(system)
    a, loads = closed_form(float(system.length))
    found, forces = mbs.dynamics.joint_friction(system, state), mbs.reactions(system, state)
    assert abs(loads[0] - loads[1]) > 10.0
    for k, name in enumerate(("near", "far")):
        assert found.loads[name] == pytest.approx(loads[k], rel=1e-6)
        assert np.hypot(*forces[name].force[:2]) == pytest.approx(loads[k], rel=1e-6)
        assert found.shared[name] and not found.unique[name] and not found.jammed[name]
    assert forces.ok and mbs.dynamics.forward_dynamics(system, state)[0][0] == pytest.approx(a, rel=1e-6)

    def acceleration(mu):
        return mbs.dynamics.forward_dynamics(door(mu, solver, system), state)[0][0]

    h = 1e-4
    slope = (closed_form(float(system.length), MU + h)[0] - closed_form(float(system.length), MU - h)[0]) / (2 * h)
    assert jax.grad(acceleration)(MU) == pytest.approx(slope, rel=1e-6)
    assert jax.jacfwd(acceleration)(MU) == pytest.approx(slope, rel=1e-6)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:friction of joint")
def test_a_body_welded_to_the_door_changes_nothing():
    system = door(handle=5.0)
    state = state_of(system)
    _, loads = closed_form(float(system.length))
    found = mbs.dynamics.joint_friction(system, state)
    for k, name in enumerate(("near", "far")):
        assert found.loads[name] == pytest.approx(loads[k], rel=1e-6)
        assert np.hypot(*mbs.reactions(system, state)[name].force[:2]) == pytest.approx(loads[k], rel=1e-6)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:friction of joint")
def test_effort_of_a_drive_carries_the_shared_friction():
    system = door()
    state = state_of(system)
    name = "near" if system.topology.joint_index["near"] in system.topology.body_joint else "far"
    arm = {"near": RADII[0], "far": RADII[1]}
    loads = mbs.reactions(system, state, accelerations=[0.5], actuators=[name])
    total = {n: np.hypot(*loads[n].force[:2]) for n in arm}
    both = sum(MU * arm[n] * total[n] for n in arm)
    balance = (INERTIA + MASS * LEVER**2) * 0.5 + MASS * GRAVITY * LEVER + both
    assert loads[name].effort[0] == pytest.approx(balance, rel=1e-6)
    soft = mbs.reactions(system, state, accelerations=[0.5], actuators=[name], compliance={"far": 9.0})
    total = {n: np.hypot(*soft[n].force[:2]) for n in arm}
    assert soft.ok and total["far"] < 0.5 * np.hypot(*loads["far"].force[:2])
    balance = balance - both + sum(MU * arm[n] * total[n] for n in arm)
    assert soft[name].effort[0] == pytest.approx(balance, rel=1e-6)
