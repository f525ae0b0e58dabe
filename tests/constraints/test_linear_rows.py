"""Steps, ranks and branches of linearised rows by the frontal method are those of their matrix."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.assembly._branches import branch_signs
from jaxmbs.constraints import _closures as closures
from jaxmbs.constraints._kic import position_map, velocity_map
from jaxmbs.constraints._linear_rows import linear_rows
from jaxmbs.constraints._linear_solver import with_linear_solver
from jaxmbs.constraints._rank import constraint_rank
from jaxmbs.kinematics._configuration import at_state
from tests.cases import models
from tests.constraints.test_frontal_saddle import row_of
from tests.models import four_bar, four_bar_state, slopes
from tests.zoo import SPECIMENS

HAVE_ROWS = {"loop", "drive", "rolling"}  # by traits, since no system is built before a test asks
LOOPS = [name for name, one in SPECIMENS.items() if one.kinds & HAVE_ROWS and name != "elastic"]


@pytest.mark.long
@pytest.mark.parametrize("name", LOOPS)
@pytest.mark.parametrize("holds", [False, True])
def test_rows_without_a_matrix(name, holds):
    specimen = SPECIMENS[name]
    n, places = specimen.system.topology.num_velocities, specimen.system.topology.position_rows
    free = np.ones(n)
    free[-1] = 0.0 if holds else 1.0
    gap, u = np.random.default_rng(0).normal(size=(2, 40))

    @jax.jit
    def found(system, state):
        at = at_state(system, state, inertias=False)
        at = closures.residual_and_directions(system, at)[1]
        rows = linear_rows(system, at, jnp.asarray(free), places)
        change = rows.rates(jnp.asarray(free * u[:n]))
        steps = rows.least_step(change), rows.damped_step(gap[: len(places)], 0.1)
        every = linear_rows(system, at, jnp.ones(n)).for_ranks
        return change, *steps, constraint_rank(system, every), branch_signs(system, every)

    dense, frontal = (found(with_linear_solver(specimen.system, s), specimen.state) for s in ("dense", "frontal"))
    for a, b in zip(dense, frontal, strict=True):
        np.testing.assert_allclose(b, a, atol=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("name", LOOPS)
def test_independent_motions(name):
    """Velocities and positions by the independent ones."""
    specimen = SPECIMENS[name]

    @jax.jit
    def found(system, state):
        at = at_state(system, state, inertias=False)
        return *velocity_map(system, at), position_map(system, at)

    dense, frontal = (found(with_linear_solver(specimen.system, s), specimen.state) for s in ("dense", "frontal"))
    for a, b in zip(dense, frontal, strict=True):
        np.testing.assert_allclose(b, a, atol=1e-8 * max(1.0, np.max(np.abs(a), initial=0.0)))


@pytest.mark.long
def test_linear_equations_of_a_row():
    """Twelve loops by their one equation."""
    system, _ = row_of(12)
    small = mbs.linearise(system, models.n_four_bar_state(system, 0.6, 0.0))
    force = 9.81 * (13 / 2 + 12)
    np.testing.assert_allclose([small.mass, small.stiffness], [[[13 / 3 + 12]], [[-force * np.cos(0.6)]]], rtol=1e-9)
    hanging = mbs.equilibrium(system, models.n_four_bar_state(system, 2.6, 0.0))
    assert hanging.ok and hanging.stable
    np.testing.assert_allclose(
        hanging.state.coordinates, models.n_four_bar_state(system, np.pi).coordinates, atol=1e-9
    )
    np.testing.assert_allclose(hanging.stiffness, [[force]], rtol=1e-9)


@pytest.mark.long
def test_a_whole_turn_of_a_row():
    """Twelve loops through two poses where branches cross."""
    system, at = row_of(12)
    angles = np.linspace(0.6, 0.6 + 2 * np.pi, 9)
    with pytest.warns(UserWarning, match="branches cross there"):
        found = mbs.assembly.states_along(system, "A0", angles, at(0.6))
    np.testing.assert_allclose(found.coordinates, [at(angle).coordinates for angle in angles], atol=1e-11)
    np.testing.assert_allclose(
        mbs.State.at(system, A0=0.9, near=at(0.6)).coordinates, at(0.9).coordinates, atol=1e-11
    )


@pytest.mark.long
def test_states_within_a_trace():
    """Of a row of twelve: coordinates, velocities, and their slopes by the angle and by a length."""
    system, at = row_of(12)
    guess = {name: -0.4 if name[0] == "A" else 0.4 for name in system.topology.joint_names if name[0] in "Al"}

    @jax.jit
    def state(angle):
        return mbs.State.at(system, A0=angle, velocities={"A0": -1.0}, guess=guess)

    found = state(-0.4)
    np.testing.assert_allclose(found.coordinates, at(-0.4).coordinates, atol=1e-12)
    np.testing.assert_allclose(found.velocities, at(-0.4).velocities, atol=1e-11)
    host = mbs.State.at(system, A0=-0.4, velocities={"A0": -1.0}, guess=guess)
    np.testing.assert_array_equal(found.branch, host.branch)
    assert float(found.rank_change) == 0.0
    slope = jax.jit(jax.jacfwd(lambda angle: state(angle).coordinates))(-0.4)
    np.testing.assert_allclose(slope, at(-0.4).velocities / -1.0, atol=1e-9)


@pytest.mark.long
def test_slopes_of_states_by_a_length():
    base = with_linear_solver(four_bar(), "frontal")
    psi = four_bar_state(base, 0.7).coordinates

    def rates(length):
        other = four_bar((1.0, 0.3, length[0], 0.7), like=base)
        system = dataclasses.replace(other, topology=base.topology)
        return mbs.State.at(system, A=0.7, velocities={"A": 2.0}, guess=_named(base, psi)).velocities

    np.testing.assert_allclose(jax.jacfwd(rates)(jnp.array([0.9])), slopes(rates, [0.9]), rtol=1e-6, atol=1e-8)


def _named(system, psi):
    return {name: float(psi[k]) for k, (name, *_) in enumerate(system.topology.structure)}


@pytest.mark.long
def test_the_rank_of_a_singular_pose_is_less():
    """A flat parallelogram has one freedom more."""
    system, at = row_of(12)
    flat = at(-np.pi / 2)

    @jax.jit
    def rank(state):
        here = closures.residual_and_directions(system, at_state(system, state, inertias=False))[1]
        return constraint_rank(system, linear_rows(system, here, jnp.ones_like(state.velocities)).for_ranks)

    regular = int(rank(at(-0.4)))
    assert regular == system.topology.analysis.rank
    assert int(rank(flat)) < regular
