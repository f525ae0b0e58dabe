"""Straps that leave their wheel and come back, on every kind of wheel, against SciPy."""

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jaxmbs as mbs
from jaxmbs.forces import Attachment, Sheave, WrapCylinder, WrapSphere

KINDS = {"sheave": Sheave, "cylinder": WrapCylinder, "sphere": WrapSphere}
of_all = pytest.mark.parametrize("wheel", KINDS.values(), ids=list(KINDS))
HALF, R, STIFF, FREE, MASS = 0.2, 0.05, 1e4, 0.38, 2.0
TOUCH = 2 * HALF * R / np.sqrt(HALF**2 - R**2)  # height of the mass at which the straight line touches the wheel


def strap(wheel, stiffness=STIFF):
    """A strap over a wheel from the ground to a mass that slides up and down."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("m", MASS)
    b.joint("z", mbs.Prismatic("z"), "ground", "m", parent_frame=(HALF, 0, 0))
    over = [Attachment(("ground", (-HALF, 0, 0))), wheel("ground", R, side="+", axis="y"), Attachment("m")]
    b.cable("strap", over, stiffness=stiffness, free_length=FREE)
    return b.build()


def length_and_slope(z):
    """Of the strap, by the plane geometry of tangents, or of the straight line."""
    if z >= TOUCH:
        straight = np.hypot(2 * HALF, z)
        return straight, z / straight
    far = np.hypot(HALF, z)
    reach = np.sqrt(far**2 - R**2)
    angle = np.pi - np.arctan2(z, HALF) - np.arccos(R / HALF) - np.arccos(R / far)
    return np.sqrt(HALF**2 - R**2) + reach + R * angle, np.sin(np.arctan2(z, HALF) - np.arcsin(R / far))


@of_all
@pytest.mark.parametrize("z", [-0.15, 0.0, 0.09, 0.11, 0.2, 0.5])
def test_length_and_force_on_and_off_the_wheel(wheel, z):
    system = strap(wheel)
    state = mbs.State.at(system, z=z)
    length, slope = length_and_slope(z)
    found = mbs.dynamics.cable_states(system, state)["strap"]
    np.testing.assert_allclose(found.length, length, rtol=1e-12)
    assert bool(found.has_left[1]) == (z > TOUCH) and not found.faults()
    force = MASS * mbs.forward_dynamics(system, state)[0][0]
    np.testing.assert_allclose(force, -STIFF * (length - FREE) * slope, rtol=1e-9, atol=1e-9)
    assert mbs.dynamics.validity(system, state).ok
    if z > TOUCH:  # drawn straight, and the wheel carries nothing
        line = np.asarray(found.points) - [-HALF, 0, 0]
        np.testing.assert_allclose(np.cross(line, [2 * HALF, 0, z]), 0.0, atol=1e-12)
        np.testing.assert_allclose(found.force[1], 0.0, atol=1e-9)
        np.testing.assert_allclose(found.moment[1], 0.0, atol=1e-9)


def passage(stiffness, speed, times):
    """Heights and their derivatives by the stiffness, SciPy: the way over the wheel and the straight one one after
    the other, each to its own end."""

    def rates(t, y):
        z, v, dz, dv = y
        (length, slope), h = length_and_slope(z), 1e-6
        side = 1.0 if z >= TOUCH else -1.0  # one side of the corner alone
        beside = [length_and_slope(z + side * k * h) for k in (0, 1, 2)]
        curve = side * (-1.5 * beside[0][1] + 2 * beside[1][1] - 0.5 * beside[2][1]) / h
        by_z = -stiffness / MASS * (slope**2 + (length - FREE) * curve)
        return [v, -stiffness / MASS * (length - FREE) * slope, dv, by_z * dz - (length - FREE) * slope / MASS]

    def corner(t, y):
        return y[0] - TOUCH

    corner.terminal = True
    t, y, found = 0.0, np.array([-0.1, speed, 0.0, 0.0]), []
    while t < times[-1]:
        part = solve_ivp(rates, (t, times[-1]), y, "DOP853", events=corner, rtol=1e-12, atol=1e-13, dense_output=True)
        found += [part.sol(x) for x in times if t < x <= part.t[-1] or x == t == 0.0]
        t, y = part.t[-1], part.y[:, -1]
        if t < times[-1]:
            y[0] = TOUCH + 1e-12 * np.sign(y[1])
    return np.array(found)


@pytest.mark.long
@of_all
def test_a_motion_leaves_the_wheel_and_comes_back(wheel):
    """Heights, energy account, and the derivative by the stiffness to 1e-6."""
    times, speed = np.linspace(0.0, 0.4, 41), 3.0
    truth = passage(STIFF, speed, times)
    assert np.sum(np.diff(truth[:, 0] > TOUCH) != 0) >= 2  # off the wheel, and on again

    def heights(stiffness):
        system = strap(wheel, stiffness=stiffness)
        start = mbs.State.at(system, z=-0.1, velocities={"z": speed})
        motion = mbs.simulate(system, start, ts=times, rtol=1e-11, atol=1e-12, gradient="forward", throw=False)
        return motion.states.coordinates[:, 0], motion

    found, slope, motion = jax.jit(lambda k: jax.jvp(heights, (k,), (1.0,), has_aux=True))(STIFF)
    assert motion.ok
    np.testing.assert_allclose(found, truth[:, 0], atol=2e-8)
    np.testing.assert_allclose(motion.diagnostics.energy_residual, 0.0, atol=1e-6)  # of some 20 J
    np.testing.assert_allclose(slope, truth[:, 2], atol=1e-6 * np.max(np.abs(truth[:, 2])))
    assert mbs.dynamics.validity(strap(wheel), motion).ok.all()
