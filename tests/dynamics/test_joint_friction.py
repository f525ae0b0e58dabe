"""Friction of joints from their own reactions: closed forms, SciPy, and the same numbers however a loop is cut."""

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jaxmbs as mbs
from jaxmbs.friction import SmoothCoulomb

from .slider_cranks import slider_crank

#: Closed forms of case CT2.
BEARING, NET, JAM, TORQUE, EFFICIENCY = 175.0, 47.5, 0.28571428571428575, 13.88068894519601, 0.34397776015356396
LENGTH, ARM, PUSH = 0.2, 0.35, 100.0
#: A frame whose z is the x of its body.
ALONG = mbs.Pose((0, 0, 0), ((0, 0, 1), (1, 0, 0), (0, 1, 0)))
MASS, LEVER, INERTIA, RADIUS, MU, TRANSITION, GRAVITY = 1.3, 0.4, 0.02, 0.03, 0.25, 0.05, 9.81


def drawer(mu, hand=False, like=None):
    """A drawer on a guide of two bearings, pushed by a force at its corner, or by a driven hand there."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("drawer", mass=2.0, inertia=(1.0, 1.0, 1.0))
    b.joint("guide", mbs.Prismatic("x"), "ground", "drawer")
    b.friction("rub", "guide", mu, length=LENGTH)
    if hand:
        b.body("hand", mass=0.1)
        b.joint("push", mbs.Prismatic("x"), "ground", "hand", drive=mbs.Ramp(0.0, 1.0))
        b.constraint("touch", mbs.joints.PointOnPlane(), between=(("drawer", ALONG), ("hand", (0, ARM, 0))))
        b.force("load", mbs.Force((-50.0, 0, 0)), on="drawer")
    else:
        b.force("pull", mbs.Force((PUSH, 0, 0)), on=("drawer", (0, ARM, 0)))
    return b.build(like=like)


def pendulum(mu=MU, like=None):
    b = mbs.SystemBuilder(gravity=(0, -GRAVITY, 0))
    b.body("bob", mass=MASS, com=(LEVER, 0, 0), inertia=(1e-3, INERTIA, INERTIA))
    b.joint("pin", mbs.Revolute("z"), "ground", "bob")
    b.friction("rub", "pin", SmoothCoulomb(mu, 1.2 * mu, TRANSITION), radius=RADIUS)
    return b.build(like=like)


def pendulum_rate(t, y):
    """The closed equations of the pendulum, their friction by a fixed point."""
    q, w = y
    slip = RADIUS * w / TRANSITION
    grip = MU * RADIUS * np.tanh(slip) * (1.0 + 0.2 * np.exp(-((slip / 10.0) ** 2)))
    a = 0.0
    for _ in range(40):
        force = MASS * np.array(
            [LEVER * (-a * np.sin(q) - w * w * np.cos(q)), LEVER * (a * np.cos(q) - w * w * np.sin(q)) + GRAVITY]
        )
        a = (-MASS * GRAVITY * LEVER * np.cos(q) - grip * np.hypot(*force)) / (INERTIA + MASS * LEVER**2)
    return [w, a]


@pytest.mark.long
def test_drawer_of_two_bearings():
    system = drawer(0.15)
    state = mbs.State.at(system, velocities={"guide": 1.0})
    found = mbs.dynamics.joint_friction(system, state)
    assert found.loads["guide"] == pytest.approx(2 * BEARING, rel=1e-12)
    net = mbs.dynamics.forward_dynamics(system, state)[0][0] * 2.0
    assert net == pytest.approx(NET, rel=1e-12)
    assert found.efforts["guide"][0] == pytest.approx(-52.5, rel=1e-12)
    assert found.powers["guide"] == pytest.approx(-52.5, rel=1e-12)
    assert found.unique["guide"] and not found.jammed["guide"]
    assert found.contraction == 0.0


@pytest.mark.long
def test_drawer_pushed_by_a_hand_jams_at_half_its_length_over_the_arm():
    jams = JAM
    assert jams == pytest.approx(LENGTH / (2 * ARM))
    system = drawer(0.15, hand=True)
    state = mbs.State.at(system)
    feedback = 0.15 / jams
    found = mbs.dynamics.joint_friction(system, state)
    assert found.contraction == pytest.approx(feedback, rel=1e-9)
    loads = mbs.reactions(system, state)
    assert loads["push"].effort[0] == pytest.approx(50.0 / (1.0 - feedback), rel=1e-9)
    assert bool(loads.ok)
    free = mbs.inverse_dynamics(system, state, actuators=["push"])
    assert free["push"][0] == pytest.approx(50.0 / (1.0 - feedback), rel=1e-9)
    stuck = drawer(1.01 * jams, hand=True, like=system)
    found = mbs.dynamics.joint_friction(stuck, state)
    assert found.contraction == pytest.approx(1.01, rel=1e-9)
    assert found.jammed["guide"] and not found.unique["guide"] and np.isnan(found.loads["guide"])
    with pytest.raises(mbs.ModelError, match="'guide'"):
        mbs.dynamics.forward_dynamics(stuck, state)
    loads = mbs.reactions(stuck, state)
    assert not loads.ok and np.isnan(loads["push"].effort[0])


@pytest.mark.long
def test_screw_that_raises_a_load():
    lead, diameter, load, mu = 0.006, 0.03, 5000.0, 0.12
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("nut", mass=1.0, inertia=(1.0, 1.0, 1.0))
    b.joint("thread", mbs.Screw("z", pitch=lead / (2 * np.pi)), "ground", "nut")
    b.force("load", mbs.Force((0, 0, -load)), on="nut")
    b.friction("rub", "thread", mu, radius=diameter / 2)
    system = b.build()
    state = mbs.State.at(system, velocities={"thread": 50.0})
    torque = mbs.inverse_dynamics(system, state, np.zeros(1))[0]
    assert torque == pytest.approx(TORQUE, rel=1e-12)
    efficiency = load * lead / (2 * np.pi) / torque
    assert efficiency == pytest.approx(EFFICIENCY, rel=1e-12)
    lowering = mbs.State.at(system, velocities={"thread": -50.0})
    r, tangent = diameter / 2, lead / (np.pi * diameter)
    held = load * r * (tangent - mu) / (1 + mu * tangent)  # negative: self-locking
    assert mbs.inverse_dynamics(system, lowering, np.zeros(1))[0] == pytest.approx(held, rel=1e-10)


@pytest.mark.parametrize("speed", [1e-4, 0.02, 0.3, 1.7, -0.3, 0.0])
def test_slope_of_the_acceleration_in_every_regime(speed):
    state = mbs.State.at(SYSTEM, pin=0.4, velocities={"pin": speed / RADIUS * TRANSITION})

    def acceleration(mu):
        return mbs.dynamics.forward_dynamics(pendulum(mu, SYSTEM), state)[0][0]

    slope, forward = SLOPES(MU, state), FORWARD(MU, state)
    h = 1e-5
    central = (acceleration(MU + h) - acceleration(MU - h)) / (2 * h)
    assert slope == pytest.approx(float(central), rel=1e-8, abs=1e-8)
    assert forward == pytest.approx(float(slope), rel=1e-12, abs=1e-14)
    assert acceleration(MU) == pytest.approx(pendulum_rate(0.0, [0.4, speed / RADIUS * TRANSITION])[1], rel=1e-12)


SYSTEM = pendulum()
SLOPES = mbs.jit(jax.grad(lambda mu, s: mbs.dynamics.forward_dynamics(pendulum(mu, SYSTEM), s)[0][0]))
FORWARD = mbs.jit(jax.jacfwd(lambda mu, s: mbs.dynamics.forward_dynamics(pendulum(mu, SYSTEM), s)[0][0]))


def by_kind(kind, **numbers):
    """A body on one joint, pushed by a force and a moment; and its state of motion."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("body", mass=1.0, inertia=(1.0, 1.0, 1.0))
    b.joint("joint", kind, "ground", "body")
    b.force("force", mbs.Force((3.0, 4.0, 12.0)), on="body")
    b.force("moment", mbs.Torque((0.3, 0.4, 0.0)), on="body")
    b.friction("rub", "joint", 0.1, **numbers)
    return b.build()


@pytest.mark.long
@pytest.mark.parametrize(
    "kind, numbers, load, effort, velocity",
    [
        # at rest but for the slip: what the body's own turning adds is not in these numbers
        (mbs.Prismatic("z"), {}, 5.0, [-0.5], [0.1]),
        (mbs.Cylindrical("z"), {"radius": 0.2}, 5.0, [-0.5, 0.0], [0.1, 0.0]),
        (mbs.Spherical(), {"radius": 0.2}, 13.0, [0.0, 0.0, -0.26], [0.0, 0.0, 0.1]),
        (mbs.Planar("z"), {}, 12.0, [-1.2 * 0.6, -1.2 * 0.8, 0.0], [0.06, 0.08, 0.0]),
        (mbs.Revolute("z"), {"radius": 0.2}, 5.0, [-0.1], [0.1]),
        (mbs.Revolute("z"), {"radius": 0.2, "length": 10.0}, 17.001, [-0.1 * 0.2 * 17.001], [0.1]),
        (mbs.Prismatic("z"), {"length": 0.1}, 2 * np.hypot(5.5, 1.0), [-0.2 * np.hypot(5.5, 1.0)], [0.1]),
        (mbs.Planar("z"), {"length": 0.01}, 80.0, [-8.0, 0.0, 0.0], [0.1, 0.0, 0.0]),
    ],
)
def test_loads_of_every_kind(kind, numbers, load, effort, velocity):
    system = by_kind(kind, **numbers)
    state = mbs.State.at(system)
    state = mbs.State(state.t, state.coordinates, np.array(velocity), structure=system.topology.structure)
    found = mbs.dynamics.joint_friction(system, state)
    assert found.loads["joint"] == pytest.approx(load, rel=1e-3)
    np.testing.assert_allclose(found.efforts["joint"], effort, rtol=1e-3, atol=1e-9)
    assert found.powers["joint"] <= 0.0


@pytest.mark.long
@pytest.mark.parametrize("options", [{}, {"formulation": "canonical"}, {"solver": mbs.ode.Rodas5P()}])
def test_pendulum_beside_scipy(options):
    times = np.linspace(0, 2, 21)
    reference = solve_ivp(pendulum_rate, (0, 2), [0.5, 2.0], method="DOP853", rtol=1e-11, atol=1e-11, t_eval=times).y
    state = mbs.State.at(SYSTEM, pin=0.5, velocities={"pin": 2.0})
    motion = mbs.simulate(SYSTEM, state, ts=times, **options)
    np.testing.assert_allclose(motion.states.coordinates[:, 0], reference[0], atol=1e-7)
    work = motion.diagnostics.work["rub"]
    assert np.all(np.diff(work) <= 1e-12) and work[-1] < -1.0
    assert np.max(np.abs(motion.diagnostics.energy_residual)) < 1e-6


def crank(cut, solver="auto"):
    """A slider-crank whose every joint rubs, as case FR2 has it, without drive."""
    b = slider_crank(-400.0)
    for name, radius in (("A", 0.02), ("B", 0.015), ("C", 0.012), ("guide", None)):
        b.friction(f"rub {name}", name, 0.12, radius=radius)
    return b.build(cut=cut, guess={"A": 0.7, "B": -0.93, "C": 0.23, "guide": 0.37}, linear_solver=solver)


@pytest.mark.long
@pytest.mark.parametrize("cut, solver", [("A", "dense"), ("B", "frontal"), ("guide", "multifrontal")])
def test_loads_are_those_of_any_cut_and_any_solver(cut, solver):
    first, other = crank(["C"], "dense"), crank([cut], solver)
    state = mbs.State.at(first, A=0.7, guess={"B": -0.93, "guide": 0.37}, velocities={"A": 5.0})
    angle = {"A": 0.7, "B": float(first.coordinates(state)["B"]), "guide": float(first.coordinates(state)["guide"])}
    rates = first.velocities(state)
    held = "A" if cut != "A" else "guide"
    guess = {name: value for name, value in angle.items() if name not in (cut, held)}
    same = mbs.State.at(other, {held: angle[held]}, guess=guess | {"C": 0.23}, velocities={held: float(rates[held])})
    found, again = mbs.dynamics.joint_friction(first, state), mbs.dynamics.joint_friction(other, same)
    for name in found.loads:
        assert again.loads[name] == pytest.approx(float(found.loads[name]), rel=1e-7)
        # statics of the plane loop leaves the force of the guide across the plane open, and only that
        assert bool(found.unique[name]) == bool(again.unique[name]) == (name != "guide")
        np.testing.assert_allclose(again.efforts[name], found.efforts[name], rtol=1e-7)
    assert again.contraction == pytest.approx(float(found.contraction), rel=1e-6)
    forces, others = mbs.reactions(first, state), mbs.reactions(other, same)
    for name in found.loads:
        np.testing.assert_allclose(others[name].force, forces[name].force, rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(others[name].moment, forces[name].moment, rtol=1e-6, atol=1e-6)
    assert forces.ok and others.ok


@pytest.mark.long
def test_motion_ends_where_the_drawer_jams():
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("drawer", mass=2.0, inertia=(1.0, 1.0, 1.0))
    b.joint("guide", mbs.Prismatic("x"), "ground", "drawer")
    b.friction("rub", "guide", 0.2, length=LENGTH)
    b.body("hand", mass=0.1)
    b.joint("push", mbs.Prismatic("x"), "ground", "hand", drive=mbs.Ramp(0.0, 1.0))
    b.joint("lift", mbs.Prismatic("y"), "hand", "finger", drive=mbs.Ramp(0.3, 1.0))
    b.body("finger", mass=0.1)
    b.constraint("touch", mbs.joints.PointOnPlane(), between=(("drawer", ALONG), "finger"))
    b.force("load", mbs.Force((-50.0, 0, 0)), on="drawer")
    system = b.build()
    with pytest.raises(mbs.SimulationError, match="jam"):
        mbs.simulate(system, mbs.State.at(system), t1=0.5, max_steps=2000)
    motion = mbs.simulate(system, mbs.State.at(system), t1=0.5, max_steps=2000, throw=False)
    assert motion.status == mbs.Status.JAMMED
    # it jams where the arm is half the length over mu, 0.5 m
    assert motion.end.t == pytest.approx(0.2, abs=0.02)
