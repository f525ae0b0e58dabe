"""Straps that leave their wheel and come back, on every kind of wheel, against SciPy."""

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jaxmbs as mbs
from jaxmbs.forces import Attachment, Eyelet, Sheave, WrapCylinder, WrapSphere

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
@pytest.mark.parametrize("tolerances", [{}, {"rtol": 1e-11, "atol": 1e-12}], ids=["default", "tight"])
def test_a_motion_leaves_the_wheel_and_comes_back(wheel, tolerances):
    """Heights, energy account, and the derivative by the stiffness to 1e-6."""
    times, speed = np.linspace(0.0, 0.4, 41), 3.0
    truth = passage(STIFF, speed, times)
    assert np.sum(np.diff(truth[:, 0] > TOUCH) != 0) >= 2  # off the wheel, and on again

    def heights(stiffness):
        system = strap(wheel, stiffness=stiffness)
        start = mbs.State.at(system, z=-0.1, velocities={"z": speed})
        motion = mbs.simulate(system, start, ts=times, gradient="forward", throw=False, **tolerances)
        return motion.states.coordinates[:, 0], motion

    found, slope, motion = mbs.jit(lambda k: jax.jvp(heights, (k,), (1.0,), has_aux=True), compile="tape")(STIFF)
    assert motion.ok
    np.testing.assert_allclose(found, truth[:, 0], atol=2e-8)
    np.testing.assert_allclose(motion.diagnostics.energy_residual, 0.0, atol=1e-6)  # of some 20 J
    np.testing.assert_allclose(slope, truth[:, 2], atol=1e-6 * np.max(np.abs(truth[:, 2])))
    assert mbs.dynamics.validity(strap(wheel), motion).ok.all()


PULL, WEIGHT = 60.0, 1.0


def band(mass, wheel, like=None):
    """An inextensible strap from a mass over a wheel and through an eye to a weight that a force pulls away."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("m", mass)
    b.body("weight", WEIGHT)
    b.joint("z", mbs.Prismatic("z"), "ground", "m", parent_frame=(HALF, 0, 0))
    b.joint("x", mbs.Prismatic("x"), "ground", "weight", parent_frame=(-HALF - 1.0, 0, 0))
    b.force("pull", mbs.Actuator(-PULL), joint="x")
    over = [Attachment("weight"), Eyelet(("ground", (-HALF, 0, 0))), wheel("ground", R, side="+", axis="y")]
    b.cable("strap", [*over, Attachment("m")], inextensible=True, free_length=1.4)
    return b.build(like=like)


def heights_of_the_band(mass, speed, times):
    """Of the mass, SciPy: Hamilton's equations in z alone with the mass `m + weight L'^2`, from corner to corner."""

    def curve(z):
        if z >= TOUCH:
            return 4 * HALF**2 / np.hypot(2 * HALF, z) ** 3
        square = HALF**2 + z**2
        turn = np.arctan2(z, HALF) - np.arcsin(R / np.sqrt(square))
        return np.cos(turn) * (HALF + R * z / np.sqrt(square - R**2)) / square

    def rates(t, y):
        slope, whole = length_and_slope(y[0])[1], mass + WEIGHT * length_and_slope(y[0])[1] ** 2
        v = y[1] / whole
        return [v, WEIGHT * slope * curve(y[0]) * v**2 - PULL * slope]

    def corner(t, y):
        return y[0] - TOUCH

    corner.terminal = True
    t, y, found = 0.0, np.array([-0.1, speed * (mass + WEIGHT * length_and_slope(-0.1)[1] ** 2)]), []
    while t < times[-1]:
        part = solve_ivp(rates, (t, times[-1]), y, "DOP853", events=corner, rtol=1e-13, atol=1e-13, dense_output=True)
        found += [part.sol(x)[0] for x in times if t < x <= part.t[-1] or x == t == 0.0]
        t, y = part.t[-1], part.y[:, -1]
        if t < times[-1]:
            y[0] = TOUCH + 1e-13 * np.sign(y[1])
    return np.array(found)


@pytest.mark.long
def test_an_inextensible_strap_leaves_the_wheel_and_comes_back(wheel=Sheave):
    """Heights, energy account, and the derivative by the mass to 1e-6, at default tolerances."""
    times, speed, mass = np.linspace(0.0, 0.5, 21), 3.0, 2.0
    truth = heights_of_the_band(mass, speed, times)
    assert np.sum(np.diff(truth > TOUCH) != 0) >= 2  # off the wheel, and on again
    far, near = (
        (heights_of_the_band(mass + h, speed, times) - heights_of_the_band(mass - h, speed, times)) / (2 * h)
        for h in (0.02, 0.01)
    )
    true_slope, like = (4 * near - far) / 3, band(mass, wheel)

    def heights(mass):
        system = band(mass, wheel, like)
        start = mbs.State.at(system, z=-0.1, velocities={"z": speed})
        motion = mbs.simulate(system, start, ts=times, gradient="forward", throw=False)
        return system.coordinates(motion.states)["z"].reshape(-1), motion

    found, slope, motion = mbs.jit(lambda m: jax.jvp(heights, (m,), (1.0,), has_aux=True), compile="tape")(mass)
    assert motion.ok
    np.testing.assert_allclose(found, truth, atol=2e-8)
    np.testing.assert_allclose(motion.diagnostics.energy_residual, 0.0, atol=1e-6)  # of some 20 J
    np.testing.assert_allclose(slope, true_slope, atol=1e-6 * np.max(np.abs(true_slope)))
    assert mbs.dynamics.validity(like, motion).ok.all()
