"""Heat of the friction of joints among the powers of elements, along a motion."""

import numpy as np
import pytest

import jaxmbs as mbs


@pytest.mark.slow
def test_heat_of_a_pendulum_that_slows_down():
    b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
    b.body("bob", mass=1.3, com=(0.4, 0, 0), inertia=(1e-3, 0.02, 0.02))
    b.joint("pin", mbs.Revolute("z"), "ground", "bob")
    b.friction("rub", "pin", mbs.friction.SmoothCoulomb(0.3, transition_speed=0.01), radius=0.03)
    system = b.build()
    start = mbs.State.at(system, pin=0.4, velocities={"pin": 2.0})
    motion = mbs.simulate(system, start, ts=np.linspace(0.0, 2.0, 101))
    found = mbs.bondgraph.element_powers(system, motion)
    heat = np.asarray(found.dissipated["rub"])
    assert np.all(heat >= 0.0) and np.max(heat) > 1.0
    load = np.stack([np.asarray(mbs.reactions(system, motion)["pin"].force)[:, k] for k in (0, 1)])
    speed = 0.03 * np.asarray(motion.states.velocities)[:, 0]
    grip = 0.3 * np.hypot(*load) * np.tanh(np.abs(speed) / 0.01)
    assert heat == pytest.approx(grip * np.abs(speed), rel=1e-6, abs=1e-9)
    assert np.max(np.abs(found.residual["rub"])) == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("view", ["detailed", "inertia", "hamiltonian"])
def test_audit_of_a_four_bar_whose_pins_rub(view):
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    for name, length in (("crank", 0.2), ("coupler", 0.6), ("rocker", 0.5)):
        b.body(name, mass=length, com=(length / 2, 0, 0), inertia=mbs.inertia.rod(length, length))
    b.joint("A", mbs.Revolute("y"), "ground", "crank")
    b.joint("B", mbs.Revolute("y"), "crank", "coupler", parent_frame=(0.2, 0, 0))
    b.joint("D", mbs.Revolute("y"), "ground", "rocker", parent_frame=(0.7, 0, 0))
    b.joint("C", mbs.Revolute("y"), "coupler", "rocker", parent_frame=(0.6, 0, 0), child_frame=(0.5, 0, 0))
    for name in "ABCD":
        b.friction(f"rub {name}", name, 0.1, radius=0.02)
    system = b.build()
    state = mbs.State.at(system, A=-0.8, guess={"B": 0.3, "D": -1.5}, velocities={"A": 2.0})
    powers = mbs.bondgraph.bond_powers(system, state, view)
    largest = max(abs(float(power)) for power in powers.power.values())
    for name, left in mbs.bondgraph.junction_residual(powers).items():
        assert abs(float(left)) < 1e-10 * max(largest, 1.0), name
    if view != "hamiltonian":
        found = mbs.dynamics.joint_friction(system, state).powers
        for name in "ABCD":
            assert float(powers.net_power(f"R:rub {name}")) == pytest.approx(-float(found[name]), rel=1e-10)
            assert float(powers.net_power(f"R:rub {name}")) > 0.0


@pytest.mark.slow
def test_bristles_store_what_they_give_back():
    """Energy of bristles at a steady load is that of a spring, and the rest is heat."""
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    b.body("block", mass=3.0, inertia=1.0)
    b.joint("guide", mbs.Prismatic("x"), "ground", "block")
    b.friction("rub", "guide", mbs.friction.LuGre(0.2, 1e4, 0.0, 0.4, stribeck_speed=0.01))
    system = b.build()
    bend, speed, load = 1.2e-5, -0.02, 3.0 * 9.81
    state = mbs.State.at(system, velocities={"guide": speed}, internal={"rub.bristle": bend})
    found = mbs.bondgraph.element_powers(system, state)
    rate = speed - abs(speed) * bend * 1e4 / 0.2
    assert float(found.stored["rub"]) == pytest.approx(load * 1e4 * bend * rate, rel=1e-12)
    heat = load * (1e4 * bend * (speed - rate) + 0.4 * speed**2)
    assert heat > 0.0 and float(found.dissipated["rub"]) == pytest.approx(heat, rel=1e-12)
    assert abs(float(found.residual["rub"])) < 1e-15
