"""Bands of holding efforts: closed forms of an incline, a screw jack and a toggle, and slopes beside differences."""

import jax
import numpy as np
import pytest

import jaxmbs as mbs

#: Screw of case CT2.
LEAD, RADIUS, LOAD, MU, RAISE = 0.006, 0.015, 5000.0, 0.12, 13.88068894519601


def incline(angle, mu, ratio=1.0, like=None):
    """A block on an incline, its slide along x uphill."""
    b = mbs.SystemBuilder(gravity=(-9.81 * np.sin(angle), 0, -9.81 * np.cos(angle)))
    b.body("block", mass=2.0, inertia=1.0)
    b.joint("slide", mbs.Prismatic("x"), "ground", "block")
    b.friction("rub", "slide", mbs.friction.SmoothCoulomb(mu, mu * ratio))
    return b.build(like=like)


def jack(mu, model=None):
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("nut", mass=1.0, inertia=(1.0, 1.0, 1.0))
    b.joint("thread", mbs.Screw("z", pitch=LEAD / (2 * np.pi)), "ground", "nut")
    b.force("load", mbs.Force((0, 0, -LOAD)), on="nut")
    b.friction("rub", "thread", mu if model is None else model, radius=RADIUS)
    return b.build()


def up(system, joint, speed=1.0):
    return mbs.State.at(system, velocities={joint: speed})


@pytest.mark.slow
def test_block_on_an_incline():
    angle, mu, ratio = 0.4, 0.3, 1.5
    system = incline(angle, mu, ratio)
    found = mbs.analysis.impending_motion(system, up(system, "slide", 0.3), ["slide"])
    weight = 2.0 * 9.81
    for limits, sign in ((found.forward, 1.0), (found.backward, -1.0)):
        expected = weight * (np.sin(angle) + sign * mu * ratio * np.cos(angle))
        assert limits["slide"][0] == pytest.approx(expected, abs=1e-9)
    assert found.ok and found.self_locking == (mu * ratio > np.tan(angle))
    assert found.efficiency == pytest.approx(1.0 / (1.0 + mu * ratio / np.tan(angle)), rel=1e-12)


@pytest.mark.slow
def test_screw_jack_locks_itself():
    tangent = LEAD / (2 * np.pi * RADIUS)
    system = jack(MU)
    found = mbs.analysis.impending_motion(system, up(system, "thread"), ["thread"])
    assert found.forward["thread"][0] == pytest.approx(RAISE, rel=1e-12)
    lower = LOAD * RADIUS * (tangent - MU) / (1 + MU * tangent)
    assert found.backward["thread"][0] == pytest.approx(lower, rel=1e-10)
    assert found.self_locking and found.efficiency == pytest.approx(0.34397776015356396, rel=1e-12)


@pytest.mark.slow
def test_screw_of_little_friction_turns_by_its_load():
    smooth = jack(None, mbs.friction.LuGre(0.9 * LEAD / (2 * np.pi * RADIUS), 1e4))
    assert not mbs.analysis.impending_motion(smooth, up(smooth, "thread"), ["thread"]).self_locking


@pytest.mark.slow
def test_slope_of_the_limit():
    system = incline(0.4, 0.3)
    state = up(system, "slide")

    def limit(mu):
        return mbs.analysis.impending_motion(incline(0.4, mu, like=system), state, ["slide"]).forward["slide"][0]

    assert jax.grad(limit)(0.3) == pytest.approx(2.0 * 9.81 * np.cos(0.4), rel=1e-10)


@pytest.mark.slow
def test_toggle_of_rubbing_pins():
    """Two equal massless links between a fixed pin and a ram: the circles of friction turn the line of force."""
    length, radius, mu, lean, press = 0.2, 0.01, 0.2, 0.15, 1000.0
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("upper", mass=1e-9, inertia=1e-12)
    b.body("lower", mass=1e-9, inertia=1e-12)
    b.body("ram", mass=1.0, inertia=1.0)
    b.joint("top", mbs.Revolute("z"), "ground", "upper")
    b.joint("knee", mbs.Revolute("z"), "upper", "lower", parent_frame=(length, 0, 0))
    b.joint("guide", mbs.Prismatic("x"), "ground", "ram")
    b.joint("foot", mbs.Revolute("z"), "lower", "ram", parent_frame=(length, 0, 0))
    b.force("press", mbs.Force((-press, 0, 0)), on="ram")
    for pin in ("top", "knee", "foot"):
        b.friction(f"rub {pin}", pin, mu, radius=radius)
    guess = {"top": lean, "knee": -2 * lean, "foot": lean, "guide": 2 * length * np.cos(lean)}
    system = b.build(guess=guess)
    state = mbs.State.at(system, top=lean, guess=guess, velocities={"top": -1.0})
    found = mbs.analysis.impending_motion(system, state, ["top"])
    # the lower link is a two-force part whose force touches the friction circles (mu R) of its pins, which turn
    # relative to it in opposite senses at the knee and at the foot: its line is turned by asin(2 mu R / length)
    for limits, sign in ((found.forward, 1.0), (found.backward, -1.0)):
        circle = sign * mu * radius
        turned = lean + np.arcsin(2 * circle / length)
        force = press / np.cos(turned)
        arm = length * np.sin(lean + turned) + circle
        assert abs(float(limits["top"][0])) == pytest.approx(force * (arm + circle), rel=1e-6)
    assert found.ok
