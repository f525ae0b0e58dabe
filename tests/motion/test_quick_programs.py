"""Programs compiled "quick" are traced with another algebra; motions, reactions and gradients are the same."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.systems import four_bar, four_bar_state, general_state, spatial_loop, spatial_tree


def ball_and_rod():
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.5))
    b.body("arm", 1.2, com=(0.2, 0.05, 0.1), inertia=(0.02, 0.03, 0.025))
    b.body("rod", 0.7, com=(0.3, 0.0, 0.02), inertia=(0.004, 0.03, 0.03))
    b.joint("ball", mbs.Spherical(), "ground", "arm", parent_frame=(0.1, 0.2, 0.3))
    b.joint("slide", mbs.Cylindrical((0.2, 1.0, 0.3)), "arm", "rod", parent_frame=(0.4, 0.0, 0.1))
    return b.build()


MODELS = {
    "four-bar": (four_bar, four_bar_state),
    "spatial loop": (spatial_loop, mbs.State.at),
    "tree": (spatial_tree, general_state),
    "ball": (ball_and_rod, lambda system: mbs.State.at(system, velocities={"ball": (1.0, -2.0, 0.5)})),
}


def numbers(system, state, scale):
    """Of a motion and of its reactions, with masses and their places scaled (2,)."""
    places = lambda s: (s.mass, s.com)  # noqa: E731
    system = eqx.tree_at(places, system, (system.mass * scale[0], system.com * scale[1]))
    motion = mbs.simulate(system, state, ts=state.t + jnp.array([0.05, 0.1]))
    loads = mbs.reactions(system, motion)
    loads = [x for name in loads for x in (loads[name].force, loads[name].moment)]
    return [motion.states.coordinates, motion.states.velocities, motion.diagnostics.kinetic, *loads]


def mixed(system, state, scale):
    """One number () of all, no two of them with the same weight."""
    flat = jnp.concatenate([x.reshape(-1) for x in numbers(system, state, scale)])
    return jnp.cos(jnp.arange(flat.size)) @ flat


@pytest.mark.parametrize("name", MODELS)
def test_motions_and_reactions(name):
    model, state = MODELS[name]
    system = model()
    arguments = system, state(system), jnp.array([1.1, 0.9])
    for ours, full in zip(mbs.jit(numbers, compile="quick")(*arguments), numbers(*arguments), strict=True):
        np.testing.assert_allclose(ours, full, rtol=1e-9, atol=1e-9 * (1.0 + np.abs(full).max()))


@pytest.mark.slow
@pytest.mark.parametrize("name", MODELS)
def test_gradients(name):
    model, state = MODELS[name]
    system = model()
    arguments = system, state(system), jnp.array([1.1, 0.9])
    slopes = jax.grad(mixed, argnums=2)
    full = mbs.jit(slopes)(*arguments)
    np.testing.assert_allclose(mbs.jit(slopes, compile="quick")(*arguments), full, rtol=1e-7)
    step = 1e-5 * np.eye(2)
    along = [mixed(*arguments[:2], arguments[2] + s) - mixed(*arguments[:2], arguments[2] - s) for s in step]
    np.testing.assert_allclose(full, np.array(along) / 2e-5, rtol=0.0, atol=1e-5 * np.abs(full).max())
