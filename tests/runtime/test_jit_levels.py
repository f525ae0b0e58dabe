"""Programs compiled "quick" are traced with another algebra; motions, reactions and gradients are the same."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs
from tests.zoo import of_all


def numbers(system, state, scale):
    """Of a motion and of its reactions, with masses and their places scaled (2,)."""
    places = lambda s: (s.mass, s.com)
    system = eqx.tree_at(places, system, (system.mass * scale[0], system.com * scale[1]))
    # the elastic arm bends by more than its model allows, which changes no number
    motion = mbs.simulate(system, state, ts=state.t + jnp.array([0.05, 0.1]), throw=False)
    loads = mbs.reactions(system, motion)
    loads = [x for name in loads for x in (loads[name].force, loads[name].moment)]
    return [motion.states.coordinates, motion.states.velocities, motion.diagnostics.kinetic, *loads]


def mixed(system, state, scale):
    """One number () of all, no two of them with the same weight."""
    flat = jnp.concatenate([x.reshape(-1) for x in numbers(system, state, scale)])
    return jnp.cos(jnp.arange(flat.size)) @ flat


def arguments_of(specimen):
    return specimen.system, specimen.state, jnp.array([1.1, 0.9])


@of_all(quick=(), slow=())
def test_motions_and_reactions(specimen):
    arguments = arguments_of(specimen)
    for ours, full in zip(mbs.jit(numbers, compile="quick")(*arguments), numbers(*arguments), strict=True):
        # of the stiff elastic arm, whose loads multiply the rounding of its places, 5e-9 on some processors
        np.testing.assert_allclose(ours, full, rtol=1e-9, atol=2e-8 * (1.0 + np.abs(full).max()))


@of_all(quick=(), slow=())
def test_gradients(specimen):
    arguments, slopes = arguments_of(specimen), jax.grad(mixed, argnums=2)
    full = mbs.jit(slopes)(*arguments)
    # of the elastic arm 2.5e-7 on some processors, for the same reason as above
    np.testing.assert_allclose(mbs.jit(slopes, compile="quick")(*arguments), full, rtol=1e-6)
    step = 1e-4 * np.eye(2)  # of the elastic arm, steps of another size are noise of 6e-5 at 1e-5
    along = [mixed(*arguments[:2], arguments[2] + s) - mixed(*arguments[:2], arguments[2] - s) for s in step]
    np.testing.assert_allclose(full, np.array(along) / 2e-4, rtol=0.0, atol=1e-5 * np.abs(full).max())
