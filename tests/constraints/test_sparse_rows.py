"""Searches on sparse rows give what those on dense rows give."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.builder._mobility import analyse_mobility
from jaxmbs.constraints._host_rows import evaluate_rows
from jaxmbs.constraints._linear_solver import with_linear_solver
from tests.cases import models
from tests.constraints.test_frontal_saddle import row_of
from tests.zoo import SPECIMENS

LOOPS = sorted(name for name, specimen in SPECIMENS.items() if specimen.system.has_constraints)


def with_solver(system, solver):
    """The system of a build with a solver, its mobility not yet counted."""
    system = with_linear_solver(system, solver)
    return dataclasses.replace(system, topology=dataclasses.replace(system.topology, analysis=None))


@pytest.mark.parametrize("name", LOOPS)
def test_rows_masses_and_reactions(name):
    specimen = SPECIMENS[name]
    psi, t = np.asarray(specimen.state.coordinates), np.asarray(specimen.state.t)
    dense, sparse = (evaluate_rows(with_solver(specimen.system, s), psi, t) for s in ("dense", "multifrontal"))
    np.testing.assert_allclose(sparse.A.toarray(), dense.A, atol=1e-12)
    np.testing.assert_allclose(sparse.f, dense.f, atol=1e-14)
    Z, Y = (np.random.default_rng(0).normal(size=(n, 11)) for n in dense.A.shape[::-1])
    np.testing.assert_allclose(sparse.M @ Z, dense.M @ Z, atol=1e-11 * np.abs(dense.M).max())
    np.testing.assert_allclose(sparse.reactions @ Y, dense.reactions @ Y, atol=1e-11)


@pytest.mark.parametrize("name", LOOPS)
def test_mobility(name):
    """Equal sets of independent velocities may be chosen in another way, all that is counted is equal."""
    found = []
    for solver in ("dense", "multifrontal"):
        counted = analyse_mobility(with_solver(SPECIMENS[name].system, solver)).topology.analysis
        free = dict.fromkeys(("independent", "independent_positions", "dependencies"), ())
        found.append(dataclasses.replace(counted, **free))
    assert found[0] == found[1]


@pytest.mark.slow
def test_states_of_a_row_of_four_bars():
    system, at = row_of(12)
    guess = {name: -0.4 if name[0] == "A" else 0.4 for name in system.topology.joint_names if name[0] in "Al"}
    state = mbs.State.at(system, A0=-0.4, velocities={"A0": -1.0}, guess=guess)
    np.testing.assert_allclose(state.coordinates, at(-0.4).coordinates, atol=1e-12)
    np.testing.assert_allclose(state.velocities, at(-0.4).velocities, atol=1e-12)
    dense = mbs.State.at(models.n_four_bar(12, linear_solver="dense"), A0=-0.4, guess=guess)
    np.testing.assert_array_equal(state.branch, dense.branch)
    assert float(state.rank_change) == 0.0 and jnp.all(state.branch != 0)
