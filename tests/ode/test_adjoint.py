"""The product of variation and adjoint stays what it is along a discrete motion: both belong to the same steps."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.test_program_size import LENGTHS, begin, chain, four_bar

STEP, STEPS = 0.02, 12


def chain_state(system):
    return mbs.State.at(system, pin0=0.3, velocities={"pin1": 2.0, "pin3": -1.0})


MODELS = {"tree": (chain, chain_state), "loop": (lambda: four_bar(LENGTHS), begin)}


@pytest.mark.long
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("solver", [mbs.ode.Gauss4, mbs.ode.ImplicitMidpoint])
def test_product_of_variation_and_adjoint(model, solver):
    build, start = MODELS[model]
    system = build()
    state, times = start(system), STEP * np.arange(STEPS + 1)
    options = {"dt": STEP, "solver": solver(), "throw": False}

    def faster(scale):
        pushed = eqx.tree_at(lambda s: s.velocities, state, scale * state.velocities)
        states = mbs.simulate(system, pushed, ts=times, gradient="forward", **options).states
        return states.coordinates, states.velocities

    def end(coordinates, velocities, t):
        from_there = eqx.tree_at(lambda s: (s.coordinates, s.velocities, s.t), state, (coordinates, velocities, t))
        last = mbs.simulate(system, from_there, ts=times[-1:], max_steps=2 * STEPS, **options).states
        return jnp.sum(jnp.sin(last.coordinates)) + jnp.sum(last.velocities)

    along, variation = jax.jit(lambda: jax.jvp(faster, (1.0,), (1.0,)))()
    adjoint = jax.jit(jax.vmap(jax.grad(end, argnums=(0, 1))))(*along, times)
    product = sum(jnp.sum(a * b, axis=1) for a, b in zip(variation, adjoint, strict=True))[:-1]
    np.testing.assert_allclose(product, product[0], rtol=1e-12)
    assert abs(product[0]) > 0.1
