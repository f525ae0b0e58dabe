"""The frontal method: saddle systems of rows of four-bars by the exact equation, near their singular pose too.

`tests/dynamics/test_sparse_saddle.py` compares it with the dense solver on all kinds of systems.
"""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.dynamics import _hamilton as hamilton
from jaxmbs.kinematics._configuration import at_state, with_velocities
from tests.cases import models

GRAVITY = 9.81


def row_of(n):
    """A row of n four-bars and the function from the cranks' angle to its state at -1 rad/s."""
    system = models.n_four_bar(n)
    return system, lambda angle: models.n_four_bar_state(system, angle)


@pytest.fixture(scope="module")
def row():
    system, at = row_of(12)
    assert system.topology.linear_solver == "frontal"
    return system, at, jax.jit(lambda state: mbs.forward_dynamics(system, state)[0])


@pytest.mark.parametrize(
    "distance, error",
    [pytest.param(1.0, 1e-13, marks=pytest.mark.long), (1e-2, 1e-12), (1e-3, 1e-11), (1e-4, 1e-7), (1e-5, 0.02)],
)
def test_accelerations_beside_the_singular_pose(row, distance, error):
    """Level cranks are singular; the dense solver errs 1e-10 at 1e-3 rad, and by 0.8 of the value at 1e-5."""
    _, at, accelerations = row
    angle = -np.pi / 2 + distance
    found = np.asarray(accelerations(at(angle)))
    np.testing.assert_allclose(found[0], models.n_four_bar_acceleration(12, angle), atol=error * GRAVITY)


@pytest.mark.long
def test_velocities_of_momenta(row):
    system, at, _ = row
    state = at(-0.4)
    here = with_velocities(system, at_state(system, state), state.velocities)
    found, _ = hamilton.velocities(system, here, hamilton.momenta(system, here))
    np.testing.assert_allclose(found, state.velocities, atol=1e-13)


@pytest.mark.long
def test_gradient_is_that_of_differences(row):
    system, at, _ = row
    state = at(-0.4)

    def value(factor):
        heavier = dataclasses.replace(system, mass=system.mass.at[3].multiply(factor))
        return jnp.sum(mbs.forward_dynamics(heavier, state)[0] ** 2)

    slope, h = jax.jit(jax.grad(value))(1.0), 1e-4
    value = jax.jit(value)
    np.testing.assert_allclose(slope, (value(1.0 + h) - value(1.0 - h)) / (2.0 * h), rtol=1e-7)


@pytest.mark.long
def test_batches(row):
    _, at, accelerations = row
    states = jax.tree.map(lambda *x: jnp.stack(x), *(at(angle) for angle in (-0.4, 0.3, 1.2)))
    found = jax.jit(jax.vmap(accelerations))(states)
    np.testing.assert_allclose(
        found[:, 0], models.n_four_bar_acceleration(12, np.array([-0.4, 0.3, 1.2])), rtol=1e-12
    )


@pytest.mark.long
def test_a_motion_through_the_singular_pose_keeps_its_energy(row):
    system, at, _ = row
    motion = mbs.simulate(system, at(-1.2), t1=1.0, rtol=1e-10, atol=1e-10)
    parts = mbs.dynamics.kinetic_energy, mbs.dynamics.potential_energy
    energy = sum(np.asarray(jax.vmap(lambda s, part=part: part(system, s))(motion.states)) for part in parts)
    assert motion.ok and motion.states.coordinates[-1, 0] < -1.8
    np.testing.assert_allclose(energy, energy[0], atol=1e-8)
