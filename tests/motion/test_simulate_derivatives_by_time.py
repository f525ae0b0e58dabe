"""Derivatives by the time of the start, by saved times, and of the time when an event ends a motion."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.zoo.mechanisms import four_bar, four_bar_state

G, HEIGHT, SPEED, START, SAVED = 9.81, 5.0, 1.0, 0.2, 0.9


@pytest.fixture(scope="module")
def stone():
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -G))
    b.body("stone", mass=2.0, inertia=0.1)
    b.joint("up", mbs.Prismatic("z"), "ground", "stone")
    return b.build()


@pytest.mark.long
@pytest.mark.parametrize("mode", ["forward", "reverse"])
def test_a_stone_that_is_thrown(stone, mode):
    """It hits the ground `(v + sqrt(v^2 + 2 g h)) / g` after its start."""

    def asked(x):
        height, speed, start = x
        state = mbs.State(start, height[None], speed[None], structure=stone.topology.structure)
        motion = mbs.simulate(
            stone, state, ts=jnp.array([SAVED, 3.0]), event=lambda s: s.coordinates[0], gradient=mode
        )
        return jnp.stack([motion.states.coordinates[0, 0], motion.ts[1], motion.states.velocities[1, 0]])

    x = jnp.array([HEIGHT, SPEED, START])
    slopes = jax.jit((jax.jacfwd if mode == "forward" else jax.jacrev)(asked))(x)
    for_s, root = SAVED - START, np.sqrt(SPEED**2 + 2 * G * HEIGHT)
    expected = [
        [1.0, for_s, -SPEED + G * for_s],  # the place at a saved time
        [1.0 / root, (1.0 + SPEED / root) / G, 1.0],  # the time of the event
        [-G / root, -SPEED / root, 0.0],  # the speed there
    ]
    np.testing.assert_allclose(slopes, expected, atol=1e-7)


@pytest.mark.long
@pytest.mark.parametrize("mode", ["forward", "reverse"])
def test_a_loop_saved_on_its_steps(mode):
    """Nothing depends on the clock: later times move the states along the motion, a later start moves them back; the
    start itself is saved too."""
    system = four_bar()
    begin = four_bar_state(system)

    def asked(start, ts):
        states = mbs.simulate(system, dataclasses.replace(begin, t=start), ts=ts, gradient=mode).states
        return jnp.concatenate([states.coordinates, states.velocities], axis=1), states

    ts, jacobian = begin.t + jnp.array([0.0, 0.05, 0.15]), jax.jacfwd if mode == "forward" else jax.jacrev
    (by_start, by_ts), states = jax.jit(jacobian(asked, argnums=(0, 1), has_aux=True))(begin.t, ts)
    a = jax.vmap(lambda s: mbs.forward_dynamics(system, s)[0])(states)
    rates = np.concatenate([states.velocities, a], axis=1)
    np.testing.assert_allclose(np.einsum("tit->ti", by_ts), rates, rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(by_start, -rates, rtol=1e-6, atol=1e-6)
    assert not np.any(by_ts[~np.eye(3, dtype=bool)[:, None].repeat(rates.shape[1], 1)])
