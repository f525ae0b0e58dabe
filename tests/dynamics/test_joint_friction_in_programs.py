"""Friction of joints side by side, in single precision, on sparse solvers, beside drives, and in both modes of
derivatives."""

import jax
import numpy as np
import pytest

import jaxmbs as mbs

MU, TIMES = 0.12, np.linspace(0.0, 0.2, 5)


def crank(mu=MU, drive=None, solver="auto", like=None):
    """A slider-crank whose pins rub; its slider is free in the plane's line only."""
    b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
    b.body("crank", mass=0.5, com=(0.05, 0, 0), inertia=(1e-3, 1e-3, 1e-3))
    b.body("rod", mass=1.0, com=(0.12, 0, 0), inertia=(1e-4, 0.01, 0.01))
    b.body("slider", mass=2.0, inertia=(1e-3, 1e-3, 1e-3))
    b.joint("A", mbs.Revolute("z"), "ground", "crank", drive=drive)
    b.joint("B", mbs.Revolute("z"), "crank", "rod", parent_frame=(0.1, 0, 0))
    b.joint("guide", mbs.Prismatic("x"), "ground", "slider")
    b.joint("C", mbs.Revolute("z"), "rod", "slider", parent_frame=(0.3, 0, 0))
    b.force("load", mbs.Force((-40.0, 0, 0)), on="slider")
    for name, radius in (("A", 0.02), ("B", 0.015), ("C", 0.012)):
        b.friction(f"rub {name}", name, mu, radius=radius)
    guess = {"A": 0.7, "B": -0.93, "C": 0.23, "guide": 0.37}
    return b.build(cut=["C"], guess=guess, linear_solver=solver, like=like)


def start(system, speed=5.0):
    driven = any(getattr(row, "name", "") == "A" for row in system.rows)
    held = {} if driven else {"A": 0.7}
    return mbs.State.at(system, held, guess={"B": -0.93, "guide": 0.37}, velocities={} if driven else {"A": speed})


def end_angle(system, state, mu, solver="auto", **options):
    """Angle of the crank at the end of a short motion."""
    rough = crank(mu, solver=solver, like=system)
    motion = mbs.simulate(rough, state, ts=TIMES, rtol=1e-9, atol=1e-9, **options)
    return motion.states.coordinates[-1, 0]


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:friction of joint")
def test_motions_side_by_side_are_those_one_by_one():
    system = crank()
    state = start(system)
    mus = np.array([0.0, 0.05, 0.2])
    found = mbs.batch(lambda mu: end_angle(system, state, mu), mus, progress=False)
    found = np.asarray(getattr(found, "values", found))
    assert found == pytest.approx([float(end_angle(system, state, mu)) for mu in mus], rel=1e-9)
    assert np.all(np.diff(found) != 0.0)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:friction of joint")
def test_both_modes_through_a_motion():
    system = crank()
    state, h = start(system), 1e-4
    central = (end_angle(system, state, MU + h) - end_angle(system, state, MU - h)) / (2 * h)
    reverse = jax.grad(lambda mu: end_angle(system, state, mu))(MU)
    forward = jax.jacfwd(lambda mu: end_angle(system, state, mu, gradient="forward"))(MU)
    assert [float(reverse), float(forward)] == pytest.approx([float(central)] * 2, rel=1e-5)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:friction of joint")
@pytest.mark.parametrize("solver", ["dense", "frontal", "multifrontal"])
def test_slopes_on_every_solver(solver):
    system, h = crank(solver=solver), 1e-5
    state = start(system)

    def acceleration(mu):
        return mbs.dynamics.forward_dynamics(crank(mu, solver=solver, like=system), state)[0][0]

    central = (acceleration(MU + h) - acceleration(MU - h)) / (2 * h)
    for slope in (jax.grad(acceleration)(MU), jax.jacfwd(acceleration)(MU)):
        assert float(slope) == pytest.approx(float(central), rel=1e-7)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:friction of joint")
def test_effort_of_a_drive_balances_heat_and_its_slope():
    """At a steady crank the drive's power is that of inertia, weight and load, and the heat of the pins."""
    ramp, h = mbs.Ramp(0.7, 5.0), 1e-5
    system = crank(drive=ramp)
    state = start(system)

    def effort(mu):
        return mbs.reactions(crank(mu, ramp, like=system), state)["A"].effort[0]

    heat = -sum(float(p) for p in mbs.dynamics.joint_friction(system, state).powers.values())
    assert heat > 0.1
    assert float(effort(MU) - effort(0.0)) * 5.0 == pytest.approx(heat, rel=1e-9)
    central = (effort(MU + h) - effort(MU - h)) / (2 * h)
    for slope in (jax.grad(effort)(MU), jax.jacfwd(effort)(MU)):
        assert float(slope) == pytest.approx(float(central), rel=1e-7)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:friction of joint", "ignore:building in single")
def test_single_precision_is_that_of_double():
    system = crank()
    double = mbs.dynamics.joint_friction(system, start(system))
    with jax.enable_x64(False):
        system = crank()
        single = mbs.dynamics.joint_friction(system, start(system))
        slope = jax.grad(lambda mu: mbs.dynamics.forward_dynamics(crank(mu, like=system), start(system))[0][0])(MU)
        assert slope.dtype == np.float32 and np.isfinite(slope) and slope != 0.0
    for name, load in double.loads.items():
        assert single.loads[name].dtype == np.float32
        assert float(single.loads[name]) == pytest.approx(float(load), rel=2e-4)
