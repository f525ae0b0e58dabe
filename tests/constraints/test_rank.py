"""Rank of constraint rows: by elimination within a trace as by singular values on the host."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.constraints._rank import constraint_rank
from tests.models import bennett, four_bar, four_bar_state

SIZES = [(5, 3, 2), (2, 3, 2), (6, 3, 1), (12, 3, 0), (1, 3, 1)]
SIZES += [pytest.param(40, 3, 3, marks=pytest.mark.long)]


@pytest.mark.parametrize("rows, columns, rank", SIZES)
def test_rank_of_random_rows(rows, columns, rank):
    system, random = four_bar(), np.random.default_rng(rows)
    A = random.normal(size=(rows, rank)) @ random.normal(size=(rank, columns))
    A *= 10.0 ** random.uniform(-1, 1, size=(rows, 1))
    traced = jax.jit(lambda A: constraint_rank(system, A))
    assert constraint_rank(system, A) == traced(A) == rank
    noise = 1e-12 * np.max(np.abs(A), initial=1.0) * random.normal(size=A.shape)
    assert constraint_rank(system, A + noise) == traced(A + noise) == rank
    assert not np.any(jax.jacfwd(lambda A: traced(A).astype(float))(jnp.asarray(A)))


@pytest.mark.long
@pytest.mark.parametrize("model, rank", [("four-bar", 2), ("Bennett", 2)])
def test_rank_at_random_poses_of_loops(model, rank):
    """Redundant rows are consistent on the manifold only; a batch of poses counts as one pose does."""
    system = four_bar() if model == "four-bar" else bennett().build()
    if model == "four-bar":
        states = jax.vmap(lambda x: mbs.State.at(system, A=x, guess={"B": -0.4, "D": 1.4}))(jnp.linspace(0.2, 1.2, 7))
        assert four_bar_state(system).rank_change == 0
    else:
        first, name = mbs.State.at(system), system.topology.structure[0][0]
        start = system.coordinates(first)
        near = jnp.linspace(-0.3, 0.3, 7) + start[name]
        guess = {key: value for key, value in start.items() if key != name}
        states = jax.vmap(lambda x: mbs.State.at(system, {name: x}, guess=guess))(near)
    assert states.ok.all() and system.topology.analysis.rank == rank
    np.testing.assert_array_equal(states.rank_change, 0.0)
