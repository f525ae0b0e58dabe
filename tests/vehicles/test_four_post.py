"""A car on four posts: over frequency and in time, at low frequencies as one rigid body; posts that follow a road."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import vehicles

from .test_parts import wishbones

TYRES = tuple(vehicles.Tyre(tyre.model, has_relaxation=False) for tyre in wishbones(0.0).tyres)  # linear at rest
TS = np.linspace(8.0, 10.0, 61)
CORNERS = ("front left", "front right", "rear left", "rear right")


def on_posts(posts, like=None):
    axles = (axle._replace(tyres=TYRES) for axle in (wishbones(1.2), wishbones(-1.4)))
    b, parts = vehicles.car(*axles, 1000.0, (0, 0, 0.5), (400, 1500, 1700), posts=posts)
    return b.build(linear_solver="dense", like=like), parts


def settled(system):
    motion = simulated(system, mbs.State.at(system))
    return jax.tree.map(lambda x: x[-1], motion.states)


def simulated(system, state):
    return mbs.simulate(system, state, ts=np.append(0.0, TS), rtol=1e-6, atol=1e-8)


@pytest.mark.long
def test_frequency_and_time():
    """Chassis and a hardpoint under heave, by the transfer function and by a motion of small amplitude."""
    size, frequency = 1e-3, 1.5
    system, parts = on_posts(lambda name: mbs.forces.Harmonic(0.0, 0.0, 2 * np.pi * frequency, np.pi / 2))
    state = settled(system)
    posts = [f"{name} post" for name in CORNERS]
    linear = vehicles.linearise_hardpoints(system, state, posts, parts["front left"], "chassis")
    assert linear.output_names[:3] == tuple(f"{next(iter(parts['front left'].points))} {axis}" for axis in "xyz")
    by_force = vehicles.four_post(linear, [frequency])
    places = mbs.linearise(system, state, posts, outputs=lambda s, a: system.coordinates(s)["chassis"][:3])
    slow = vehicles.four_post(places, [0.02], motions=["heave", "roll", "warp"])
    np.testing.assert_allclose(slow.transfer[0, 2], [1.0, 0.0, 0.0], atol=2e-3)
    moving, _ = on_posts(lambda name: mbs.forces.Harmonic(-size, size, 2 * np.pi * frequency, np.pi / 2), like=system)
    start = dataclasses.replace(state, t=jnp.zeros(()))
    motion = simulated(moving, start)
    loads = vehicles.hardpoint_loads(moving, motion, parts["front left"], "chassis")
    angle = 2 * np.pi * frequency * TS
    waves = np.stack([np.cos(angle), -np.sin(angle), np.ones_like(TS)], 1)
    for k, (name, found) in enumerate(loads.items()):
        parts_of = np.linalg.lstsq(waves, np.asarray(found)[1:], rcond=None)[0]
        wanted = size * np.asarray(by_force.transfer[0, 3 * k : 3 * k + 3, 0])
        tall = size * np.abs(np.asarray(by_force.transfer[0, :, 0])).max()
        np.testing.assert_allclose(parts_of[0] + 1j * parts_of[1], wanted, atol=2e-3 * tall, err_msg=name)


def test_posts_follow_a_road():
    x = np.linspace(0.0, 30.0, 61)
    tracks = np.stack([np.sin(x), np.cos(x)], axis=1)
    wheels = {"front left": (1.2, "left"), "rear left": (-1.4, "left"), "rear right": (-1.4, "right")}
    posts = vehicles.post_heights(x, tracks, 10.0, wheels)
    t = 0.85
    np.testing.assert_allclose(posts["rear left"](t), np.sin(8.5), atol=1e-12)
    np.testing.assert_allclose(posts["rear right"](t), np.cos(8.5), atol=1e-12)
    np.testing.assert_allclose(posts["front left"](t), posts["rear left"](t + 0.26), atol=1e-12)
    with pytest.raises(mbs.ModelError, match="speed must be one positive number"):
        vehicles.post_heights(x, tracks, -1.0, wheels)
    with pytest.raises(mbs.ModelError, match="'middle'|must be like"):
        vehicles.post_heights(x, tracks, 10.0, {"a": (0.0, "middle")})
