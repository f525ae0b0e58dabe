"""Programs compiled as users compile them, without a flag of the tests: motions, gradients and batches of every kind
of system.  `python -m pytest -m user` runs these, and `JAXMBS_COMPILE=full python -m pytest -m long` of this file the
long ones; all other tests run on tapes, and compile cheaply."""

import os

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg
from scipy.integrate import solve_ivp

import jaxmbs as mbs
from jaxmbs.elements import Beam, PointMass
from jaxmbs.fem import Structure, assemble
from jaxmbs.kinematics._poses import coordinate_rate
from tests.zoo import SPECIMENS

TIMES, DESIGN, STEP = np.array([0.02, 0.05]), np.array([1.1, 0.9]), 1e-5
KINDS = ("tree", "floating", "four_bar", "driven", "rolling", "elastic")
LONG = ("tree", "floating", "driven", "rolling", "elastic")  # of gradients
SLOW_MOTIONS = ("elastic",)


@pytest.mark.user
def test_no_flag_of_the_tests_is_set():
    assert "small_while_loop" not in os.environ.get("XLA_FLAGS", "")
    assert "backend_optimization_level" not in os.environ.get("XLA_FLAGS", "")


def scaled(system, scale):
    """The system with its masses and their places scaled by two numbers (2,)."""
    places = lambda s: (s.mass, s.com)
    return eqx.tree_at(places, system, (system.mass * scale[0], system.com * scale[1]))


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=pytest.mark.long if n in SLOW_MOTIONS else pytest.mark.user) for n in KINDS],
)
def test_a_motion_is_that_of_scipy(name):
    """Of the accelerations of `forward_dynamics`, by Dormand and Prince's pair of order 8 in SciPy."""
    system, state = SPECIMENS[name].system, SPECIMENS[name].state
    n = len(state.coordinates)

    @mbs.jit
    def rate(t, y):
        now = mbs.State(t, y[:n], y[n:])
        return jnp.concatenate([coordinate_rate(system.topology, y[:n], y[n:]), mbs.forward_dynamics(system, now)[0]])

    start, ts = np.concatenate([state.coordinates, state.velocities]), float(state.t) + TIMES
    truth = solve_ivp(rate, (float(state.t), ts[-1]), start, "DOP853", ts, rtol=1e-10, atol=1e-11).y.T
    # the elastic arm bends by more than linear elasticity is for: the numbers are those of the equations still
    states = mbs.simulate(system, state, ts=ts, rtol=1e-9, atol=1e-10, throw=False).states
    found = np.concatenate([states.coordinates, states.velocities], axis=1)
    np.testing.assert_allclose(found, truth, atol=2e-7 * np.abs(truth).max())


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.long if name in LONG else pytest.mark.user) for name in KINDS]
)
def test_a_gradient_is_that_of_differences_in_a_batch(name):
    """Of the end of a motion and its reactions, mixed to one number; the batch holds the design itself too."""
    system, state = SPECIMENS[name].system, SPECIMENS[name].state

    def mixed(scale):
        design = scaled(system, scale)
        motion = mbs.simulate(design, state, ts=state.t + jnp.asarray(TIMES))
        loads = mbs.reactions(design, motion)
        parts = [motion.states.coordinates, motion.states.velocities]
        parts += [x for joint in loads for x in (loads[joint].force, loads[joint].moment)]
        flat = jnp.concatenate([x.reshape(-1) for x in parts])
        return jnp.cos(jnp.arange(flat.size)) @ flat

    value, slope = mbs.jit(jax.value_and_grad(mixed))(jnp.asarray(DESIGN))
    designs = DESIGN + STEP * np.concatenate([np.zeros((1, 2)), np.eye(2), -np.eye(2)])
    batch = mbs.batch(mixed, jnp.asarray(designs), progress=False)
    values = np.asarray(batch.values)
    np.testing.assert_allclose(values[0], value, rtol=1e-9)
    differences = (values[1:3] - values[3:]) / (2.0 * STEP)
    np.testing.assert_allclose(slope, differences, atol=1e-5 * np.abs(differences).max())


def mast(thickness):
    """A clamped mast of four beams with a mass at its tip."""
    nodes = {f"n{k}": (0.0, 0.0, 0.5 * k) for k in range(5)}
    inertias = jnp.array([5e-6, 8e-6]) * thickness**3
    beam = Beam(2.1e11, 8.1e10, 0.01 * thickness, *inertias, 1.3e-5, density=7850.0, reference=(1.0, 0.0, 0.0))
    parts = {"mast": (beam, [(f"n{k}", f"n{k + 1}") for k in range(4)]), "tip": (PointMass(40.0), [("n4",)])}
    return assemble(Structure(nodes, parts, held={"n0": "all"}))


def answers(thickness):
    """Frequencies, a transient, a frequency response and a deflection of the mast."""
    system, ts = mast(thickness).with_damping(2e-6 * mast(thickness).stiffness), jnp.linspace(0.0, 0.02, 5)
    push = {"n4 x": 1e3}
    motion = mbs.simulate(system, ts=ts, forces={"n4 x": jnp.full(5, 1e3)})
    response = mbs.frequency_response(system, jnp.array([60.0, 200.0]), into=["n4 x"], out=["n2 x"])
    return {
        "frequencies": mbs.modes(system, damped=False).omega[:4],
        "motion": motion.displacement[-1],
        "response": jnp.abs(response.values).reshape(-1),
        "deflection": mbs.equilibrium(system, push).displacement,
    }


@pytest.mark.user
def test_a_structure():
    """Frequencies by SciPy, the deflection of a cantilever, and slopes of all answers by a batch."""
    system, found = mast(1.0), mbs.jit(answers)(jnp.asarray(1.0))
    values = scipy.linalg.eigh(np.asarray(system.stiffness), np.asarray(system.mass), eigvals_only=True)
    np.testing.assert_allclose(found["frequencies"] ** 2, values[:4], rtol=1e-9)
    np.testing.assert_allclose(np.max(found["deflection"]), 1e3 * 2.0**3 / (3.0 * 2.1e11 * 8e-6), rtol=1e-9)

    def mixed(thickness):
        parts = answers(thickness)
        return sum(jnp.cos(jnp.arange(x.size)) @ (x / jnp.linalg.norm(found[name])) for name, x in parts.items())

    value, slope = mbs.jit(jax.value_and_grad(mixed))(jnp.asarray(1.0))
    values = np.asarray(mbs.batch(mixed, 1.0 + STEP * jnp.array([0.0, 1.0, -1.0]), progress=False).values)
    np.testing.assert_allclose(values[0], value, rtol=1e-9)
    np.testing.assert_allclose(slope, (values[1] - values[2]) / (2.0 * STEP), rtol=1e-5)
