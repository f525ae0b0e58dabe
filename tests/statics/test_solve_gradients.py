"""Derivatives of reactions: against finite differences, in redundant networks too, first and second."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.statics import bond_reactions
from tests.marks import cases
from tests.statics.networks import applied, four_bar, random_bonds, random_loads

LEAVES = ("position", "frame", "effort", "compliance", "length")


@pytest.fixture(scope="module", params=["force", "nodal"])
def problem(request):
    """A loss of all reactions with respect to every number, and a direction; the network is redundant and held."""
    bonds = random_bonds("loops", seed=7, most_free=2)
    random = np.random.default_rng(2)
    numbers = {name: getattr(bonds, name) for name in LEAVES} | {"loads": jnp.asarray(random_loads(bonds))}
    weights = jnp.asarray(random.normal(size=(len(bonds.effort), 6)))
    step = {name: jnp.asarray(random.normal(size=x.shape)) for name, x in numbers.items()}
    step["effort"] = jnp.where(bonds.effort != 0, step["effort"], 0.0)
    step["compliance"] = 0.1 * (step["compliance"] + jnp.swapaxes(step["compliance"], 1, 2))

    def loss(numbers):
        there = eqx.tree_at(lambda b: tuple(getattr(b, n) for n in LEAVES), bonds, tuple(numbers[n] for n in LEAVES))
        found = bond_reactions(there, numbers["loads"], request.param)
        return jnp.sum(weights * found.components + 0.1 * found.components**2)

    return jax.jit(jax.value_and_grad(loss)), loss, numbers, step


def along(step, x, h):
    return jax.tree.map(lambda a, b: a + h * b, x, step)


@pytest.mark.parametrize("name", cases([*LEAVES, "loads"], long=["position", "frame"], rest=pytest.mark.slow))
def test_gradient(problem, name):
    both, _, numbers, step = problem
    only = {key: x if key == name else jnp.zeros_like(x) for key, x in step.items()}
    h = 1e-5
    slope = (both(along(only, numbers, h))[0] - both(along(only, numbers, -h))[0]) / (2 * h)
    exact = jnp.sum(both(numbers)[1][name] * step[name])
    if name == "length":  # only weighs the residuals here, which are left out
        assert exact == 0.0 and abs(slope) < 1e-6
    else:
        np.testing.assert_allclose(exact, slope, rtol=1e-6)


@pytest.mark.long
@pytest.mark.parametrize("problem", ["force"], indirect=True)
def test_second_derivative(problem):
    both, loss, numbers, step = problem
    h = 1e-4  # the first derivative has nine digits
    slope = jax.tree.map(
        lambda a, b: (a - b) / (2 * h), both(along(step, numbers, h))[1], both(along(step, numbers, -h))[1]
    )
    exact = jax.jit(lambda x: jax.jvp(jax.grad(loss), (x,), (step,))[1])(numbers)
    for name in exact:
        scale = float(jnp.max(jnp.abs(slope[name])))
        np.testing.assert_allclose(exact[name], slope[name], atol=1e-5 * scale + 1e-7)


@pytest.mark.long
def test_gradient_without_loads_is_finite(problem):
    both, _, numbers, _ = problem
    idle = {**numbers, "effort": 0.0 * numbers["effort"], "loads": 0.0 * numbers["loads"]}
    assert all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(both(idle)))


@pytest.mark.long
@pytest.mark.parametrize("order", [1, 2])
def test_planar_loop_in_space_by_its_lengths(order):
    """Redundant at every length: the undetermined reactions have first and second derivatives too."""

    def reaction(lengths):
        bonds = four_bar(lengths, driven=True)
        tip = np.array([0.9, 1.7, 0.2])
        loads = applied(["crank", "coupler", "rocker"], {"coupler": [((3.0, -10.0, 4.0), tip)]})
        return bond_reactions(bonds, loads).components

    x, h = jnp.array([2.0, 1.0, 2.2, 1.6]), 1e-5
    lower = reaction if order == 1 else jax.jacfwd(reaction)
    both = jax.jit(lambda x: (lower(x), jax.jacfwd(lower)(x)))
    exact = both(x)[1]
    for k in range(4):
        slope = (both(x.at[k].add(h))[0] - both(x.at[k].add(-h))[0]) / (2 * h)
        np.testing.assert_allclose(exact[..., k], slope, atol=1e-5)
