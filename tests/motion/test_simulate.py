"""Solvers, formulations and batches on chains and loops."""

import diffrax
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

import jaxmbs as mbs
from tests import random_systems as rs
from tests.cases import models
from tests.models import four_bar, four_bar_angles, four_bar_state

STEPS = {"dt": 0.01, "solver": diffrax.Tsit5()}


# ------------------------------------------------------------------------------------- semi-implicit Euler
@pytest.fixture(scope="module")
def chain():
    kinds = [mbs.Revolute(axis=(1.0, 0.2, -0.4)), mbs.Revolute(axis="y"), mbs.Prismatic(axis=(0.2, 0.1, 1.0))]
    links = rs.random_links(4, kinds, parents=(-1, 0, 1))
    system = rs.build(links)
    return links, system, rs.random_state(system, 4, spread=0.5)


def euler(chain, dt, t1=0.1):
    _, system, state = chain
    motion = mbs.simulate(system, state, ts=jnp.array([t1]), dt=dt, solver=mbs.ode.SemiImplicitEuler())
    return np.r_[np.asarray(motion.states.coordinates[0]), np.asarray(motion.states.velocities[0])]


@pytest.mark.long
def test_semi_implicit_euler_is_that_of_mujoco(chain):
    links, _, state = chain
    model = rs.mujoco_model(links)
    data = rs.mujoco_data(model, state)
    for _ in range(100):
        mujoco.mj_step(model, data)
    np.testing.assert_allclose(euler(chain, 0.001), np.r_[data.qpos, data.qvel], rtol=1e-9, atol=1e-9)


@pytest.mark.long
def test_semi_implicit_euler_sums_the_work():
    """What a damper takes from a mass that glides."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("mass", mass=3.0)
    b.joint("slide", mbs.Prismatic("x"), "ground", "mass")
    b.force("damper", mbs.SpringDamper(stiffness=0.0, damping=1.5), joint="slide")
    system = b.build()
    start = mbs.State.at(system, velocities={"slide": 2.0})
    motion = mbs.simulate(system, start, ts=jnp.array([0.4]), dt=1e-3, solver=mbs.ode.SemiImplicitEuler())
    lost = 0.5 * 3.0 * 2.0**2 * (np.exp(-2 * 1.5 / 3.0 * 0.4) - 1.0)
    np.testing.assert_allclose(motion.diagnostics.work["damper"][-1], lost, rtol=2e-3)


@pytest.mark.long
def test_semi_implicit_euler_is_of_first_order(chain):
    _, system, state = chain
    exact = mbs.simulate(system, state, ts=jnp.array([0.1]), rtol=1e-11, atol=1e-11).states
    exact = np.r_[np.asarray(exact.coordinates[0]), np.asarray(exact.velocities[0])]
    coarse, fine = (np.linalg.norm(euler(chain, dt) - exact) for dt in (2e-3, 1e-3))
    assert 1e-5 < fine < 0.1
    assert 1.9 < coarse / fine < 2.1


# ------------------------------------------------------------------------------------------------ stiffness
@pytest.mark.long
def test_a_stiff_spring_needs_few_steps_of_an_implicit_solver():
    """A mass on k = 1e8 N/m with heavy damping creeps; x = x0 exp(-k/c t) beside a fast transient."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("mass", mass=1.0)
    b.joint("slide", mbs.Prismatic(axis="x"), "ground", "mass")
    b.force("mount", mbs.SpringDamper(stiffness=1e6, damping=1e6), joint="slide")
    system = b.build()
    state = mbs.State.at(system, slide=1.0, velocities={"slide": 0.0})
    motion = mbs.simulate(system, state, ts=jnp.array([0.5, 1.0]), solver=diffrax.Kvaerno5(), rtol=1e-8, atol=1e-10)
    slow = (-1e6 + np.sqrt(1e12 - 4e6)) / 2
    fast = -1e6 - slow
    expected = [(slow * np.exp(fast * t) - fast * np.exp(slow * t)) / (slow - fast) for t in (0.5, 1.0)]
    np.testing.assert_allclose(motion.states.coordinates[:, 0], expected, rtol=1e-6)
    assert int(motion.diagnostics.num_steps) < 500  # the stability limit of an explicit solver is near 3e-6 s


# ---------------------------------------------------------------------------------------------------- loops
@pytest.mark.long
def test_slider_crank_turns_through_dead_centre():
    """Many turns; the energy after 3 s is that of the start."""
    system = models.slider_crank()
    state = mbs.State.at(system, main=0.4, velocities={"main": 30.0}, guess=models.slider_crank_guess(0.4))
    motion = mbs.simulate(system, state, ts=jnp.linspace(0.5, 3.0, 6))
    turns = float(motion.states.coordinates[-1, 0]) / (2 * np.pi)
    assert turns > 10
    residual = np.abs(np.asarray(motion.diagnostics.energy_residual))
    assert np.max(residual) < 1e-6 * float(motion.diagnostics.kinetic[0])
    assert np.max(np.asarray(motion.diagnostics.constraint_drift)) < 1e-12
    angle = np.asarray(system.coordinates(motion.states)["main"])
    slide = np.asarray(system.coordinates(motion.states)["slide"])
    np.testing.assert_allclose(slide, 0.15 * np.cos(angle) + np.sqrt(0.25 - (0.15 * np.sin(angle)) ** 2), atol=1e-10)


@pytest.fixture(scope="module")
def loop():
    system = four_bar(stiffness=3.0, load=2.0)
    return system, four_bar_state(system)


@pytest.mark.long
def test_formulations_agree(loop):
    """The momenta of the independent set give the same motion as those of all velocities."""
    ts = jnp.array([0.1, 0.3])
    canonical, independent = (
        mbs.simulate(*loop, ts=ts, formulation=name, rtol=1e-10, atol=1e-10) for name in ("canonical", "independent")
    )
    assert np.ptp(np.asarray(canonical.states.coordinates)[:, 0]) > 0.1
    for part in ("coordinates", "velocities"):
        np.testing.assert_allclose(getattr(independent.states, part), getattr(canonical.states, part), atol=1e-7)
    for motion in (canonical, independent):
        assert np.max(np.abs(np.asarray(motion.diagnostics.energy_residual))) < 1e-7


@pytest.mark.long
def test_batches_of_designs_and_states_are_single_runs(loop):
    """vmap over rebuilt systems and starting angles under jit, row by row the same as one at a time."""
    like = loop[0]

    def last(crank, angle):
        lengths = (1.0, crank, 0.9, 0.7)
        system = four_bar(lengths, stiffness=3.0, load=2.0, like=like)
        state = mbs.State.at(system, A=angle, velocities={"A": 2.0}, guess={"B": -0.3, "D": 1.5})
        motion = mbs.simulate(system, state, ts=jnp.array([0.1]), **STEPS)
        return motion.states.coordinates[0], motion.diagnostics.energy_residual[0], motion.result

    cranks, angles = jnp.array([0.3, 0.25]), jnp.array([0.7, 0.9])
    batch, energy, result = jax.jit(jax.vmap(last))(cranks, angles)
    assert np.all(np.asarray(result) == 0) and np.max(np.abs(energy)) < 1e-6
    for k in range(2):
        lengths = (1.0, float(cranks[k]), 0.9, 0.7)
        system = four_bar(lengths, stiffness=3.0, load=2.0, like=like)
        state = four_bar_state(system, float(angles[k]), lengths=lengths)
        one = mbs.simulate(system, state, ts=jnp.array([0.1]), **STEPS)
        np.testing.assert_allclose(batch[k], one.states.coordinates[0], atol=1e-10)
        closed = four_bar_angles(float(batch[k][0]), lengths)
        np.testing.assert_allclose(batch[k], closed, atol=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("gradient", ["reverse", "forward"])
def test_gradient_modes_change_no_value(loop, gradient):
    motion = mbs.simulate(*loop, ts=jnp.array([0.1]), gradient=gradient, **STEPS)
    reference = mbs.simulate(*loop, ts=jnp.array([0.1]), rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(motion.states.coordinates, reference.states.coordinates, atol=1e-8)
