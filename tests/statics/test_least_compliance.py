"""S1 section 4: the reactions cost far less than Gauss, in counted operations of the programs, not in seconds."""

import sys
from pathlib import Path

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

from jaxmbs.statics import Bonds, bond_reactions
from jaxmbs.statics import _least_compliance as least_compliance
from tests.statics.networks import PIN, ladder

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))
from program_size import operations  # noqa: E402

MOST, USUAL = least_compliance._MAX_ROUNDS, 3  # rounds of the loop that closes the free directions


def cost(bonds, rounds=MOST):
    """Operations of one solution, and of Gauss on the 6 equations of each body."""
    p = len(bonds.network.bodies)
    ours = operations(lambda loads: bond_reactions(bonds, loads).components, jnp.zeros((p, 6)), rounds=rounds)
    return ours, 2 / 3 * (6.0 * p) ** 3


def arm(p):
    """An open chain of pins, each after the other."""
    bodies = ["ground", *(f"link {k}" for k in range(p))]
    bonds = {f"pin {k}": (bodies[k], bodies[k + 1]) for k in range(p)}
    places = np.random.default_rng(0).normal(size=(p, 3))
    return Bonds.from_arrays(bodies[1:], bonds, places, carries=[PIN] * p, length=1.0)


def test_the_count_counts():
    """Two for each term of a product, loops as often as they run: numbers that one can work out."""
    A, x = jnp.ones((5, 7)), jnp.ones(7)
    assert operations(lambda A, x: A @ x + 1.0, A, x, rounds=1) == 2 * 35 + 5
    repeated = operations(lambda x: lax.fori_loop(0, 4, lambda _, y: y * 2.0 + x, x), x, rounds=1)
    assert 4 * 14 <= repeated <= 4 * 15  # and its counter
    assert (
        operations(lambda x: lax.while_loop(lambda y: y[0] < 5.0, lambda y: (A @ y) @ A, x), x, rounds=3) == 3 * 140
    )


@pytest.mark.long
def test_far_fewer_operations_than_gauss():
    """Trees, ladders of 120 bodies in usual rounds, of 480 bodies in the most there can be; growth by doubling."""
    ours, gauss = cost(arm(120))
    assert ours < gauss / 1000
    ours, gauss = cost(ladder(60), USUAL)
    assert ours < gauss / 20
    (shorter, _), (ours, gauss) = cost(ladder(120)), cost(ladder(240))
    assert ours < gauss / 20 and ours < 2.2 * shorter


@pytest.mark.long
def test_the_usual_rounds_suffice(monkeypatch):
    """Cut off after three rounds, the ladder of 120 bodies has its reactions to all digits."""
    bonds, loads = ladder(60), np.random.default_rng(0).normal(size=(120, 6))
    full = eqx.filter_jit(bond_reactions)(bonds, loads)
    monkeypatch.setattr(least_compliance, "_MAX_ROUNDS", USUAL)
    cut = eqx.filter_jit(lambda b, x: bond_reactions(b, x))(bonds, loads)
    assert cut.relative_free_residual < 1e-11 and cut.relative_residual < 1e-13
    np.testing.assert_allclose(cut.components, full.components, atol=1e-10 * float(full.scale))
