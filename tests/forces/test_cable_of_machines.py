"""Machines with cables against closed forms: Atwood's machine, a pulley block, energy of a swinging load."""

import jax
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.forces import Attachment, Sheave

G, M1, M2, LOAD, K = 9.81, 3.0, 2.0, 8.0, 1e6


def machines():
    """Masses on a cable over a fixed wheel; and a load on a moving wheel in the bight of another cable."""
    b = mbs.SystemBuilder(gravity=(0, 0, -G))
    for name, mass, x in (("one", M1, -0.1), ("two", M2, 0.1), ("load", LOAD, 2.1), ("other", 1.0, 2.4)):
        b.body(name, mass)
        b.joint(f"{name} z", mbs.Prismatic("z"), "ground", name, parent_frame=(x, 0, -1.0))
    top = Sheave(("ground", (2.3, 0, 0)), 0.1, "+", "y")
    tension = 2 * M1 * M2 * G / (M1 + M2)
    b.cable(
        "atwood",
        [Attachment("one"), Sheave("ground", 0.1, "+", "y"), Attachment("two")],
        stiffness=K,
        transition=1e-7,
        free_length=2.0 + 0.1 * np.pi - tension / K,
    )
    b.cable(
        "block",
        [Attachment(("ground", (2.0, 0, 0))), Sheave("load", 0.1, "-", "y"), top, Attachment("other")],
        stiffness=K,
        transition=1e-7,
        free_length=3.0 + 0.2 * np.pi - 12.0 / K,
    )
    return b.build()


@pytest.mark.long
def test_atwood_and_a_pulley_block():
    system = machines()
    state = mbs.State.at(system)
    found = mbs.dynamics.cable_states(system, state)
    tension = 2 * M1 * M2 * G / (M1 + M2)
    np.testing.assert_allclose(found["atwood"].tensions, tension, rtol=1e-6)
    np.testing.assert_allclose(found["block"].tensions, 12.0, rtol=1e-6)
    np.testing.assert_allclose(found["block"].wrap, [0.0, np.pi, np.pi, 0.0], rtol=1e-12)
    np.testing.assert_allclose(found["block"].force[1], [0.0, 0.0, 24.0], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(found["atwood"].force[1], [0.0, 0.0, -2 * tension], rtol=1e-6, atol=1e-9)
    assert not found["atwood"].faults() and not found["atwood"].is_slack
    rates = system.by_joint(mbs.forward_dynamics(system, state)[0])
    g = G * (M1 - M2) / (M1 + M2)
    np.testing.assert_allclose([rates["one z"], rates["two z"]], [-g, g], rtol=1e-6)
    np.testing.assert_allclose([rates["load z"], rates["other z"]], [24.0 / LOAD - G, 12.0 - G], rtol=1e-6)
    lifted = mbs.dynamics.cable_states(system, mbs.State.at(system, {"one z": 1.2, "two z": 1.2}))["atwood"]
    np.testing.assert_allclose(lifted.wrap[1], -2 * (np.arccos(0.1 / np.hypot(0.1, 0.2)) - np.arctan(0.5)), rtol=1e-9)
    assert lifted.has_left[1] and lifted.is_slack and not lifted.faults()


@pytest.mark.long
def test_energy_of_a_motion_and_its_gradient():
    """A load swings on a cable over a wheel: energy is kept, and the gradient is that of differences."""

    def build(radius, like=None):
        b = mbs.SystemBuilder(gravity=(0, 0, -G))
        b.body("load", 2.0, inertia=0.01)
        b.joint("free", mbs.Free(), "ground", "load", parent_frame=(0.1, 0, -1.0))
        path = [Attachment(("ground", (-0.5, 0.0, -0.3))), Sheave("ground", radius, "+", "y"), Attachment("load")]
        b.cable("rope", path, stiffness=2e3, free_length=1.7)
        return b.build(like=like)

    system = build(0.1)
    state = mbs.State.at(system, {"free": np.array([0.05, 0.08, 0.0, 1.0, 0.0, 0.0, 0.0])})
    motion = mbs.simulate(system, state, t1=1.0, rtol=1e-9, atol=1e-9)
    assert np.abs(motion.diagnostics.energy_residual).max() < 1e-6
    assert motion.ok

    def end(radius):
        moved = build(radius, like=system)
        return mbs.simulate(moved, state, t1=1.0, rtol=1e-9, atol=1e-9).states.coordinates[-1, 0]

    h = 1e-5
    slope = (end(0.1 + h) - end(0.1 - h)) / (2 * h)
    np.testing.assert_allclose(jax.grad(end)(0.1), slope, rtol=1e-4)
