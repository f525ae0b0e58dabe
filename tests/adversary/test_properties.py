"""Properties of random mechanisms: trees, and spatial loops that close by construction.

Numbers are drawn, structures are few, so that each structure compiles once.
"""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import jaxmbs as mbs
from jaxmbs.constraints._kic import independent_columns
from jaxmbs.dynamics._efforts import efforts
from jaxmbs.dynamics._hamilton import canonical_rate, momenta
from jaxmbs.kinematics._configuration import at_coordinates, at_state, with_velocities
from jaxmbs.kinematics._poses import coordinate_rate
from tests.random_systems import after, build, random_inertia, random_links, random_pose, random_state

SEEDS = st.integers(0, 10**6)
MANY = settings(max_examples=12, deadline=None, derandomize=True)


LIKE: dict = {}  # the first system of each structure: later ones take its count of freedoms, and its compiled code


def alike(name, build):
    """`build(like)` with the first system of that name."""
    if name not in LIKE:
        LIKE[name] = build(None)
    return build(LIKE[name])


def axis(random):
    return random.normal(size=3)


def tree(seed):
    """A branched tree of many kinds of joints under gravity."""
    random = np.random.default_rng(seed)
    kinds = [
        mbs.Revolute(axis=axis(random)),
        mbs.Spherical(),
        mbs.Prismatic(axis=axis(random)),
        mbs.Universal(),
        mbs.Cylindrical(axis=axis(random)),
    ]
    links = random_links(seed, kinds, parents=(-1, 0, 1, 0, 3))
    system = alike("tree", lambda like: build(links, like=like))
    return system, random_state(system, seed)


def loop(seed):
    """A spatial loop of one freedom (revolute, ball, cylindrical, revolute), drawn in an assembled pose."""
    random = np.random.default_rng(seed)
    poses = [(np.eye(3), np.zeros(3))] + [random_pose(random) for _ in range(3)]
    b = mbs.SystemBuilder(gravity=(0.3, -0.5, -9.81))
    names = ["ground", "one", "two", "three"]
    for name, (R, x) in zip(names[1:], poses[1:], strict=True):
        solid = {"mass": random.uniform(0.5, 2.0), "com": random.normal(size=3) * 0.2}
        b.body(name, inertia=random_inertia(random), position=x, rotation=R, **solid)
    kinds = [mbs.Revolute(axis=axis(random)), mbs.Spherical(), mbs.Cylindrical(axis=axis(random))]
    kinds.append(mbs.Revolute(axis=axis(random)))
    for k, kind in enumerate(kinds):
        ends = names[k], names[(k + 1) % 4]
        b.joint(f"j{k}", kind, *ends, at=0.5 * random.normal(size=3))
    law = mbs.SpringDamper(stiffness=random.uniform(5, 50), damping=random.uniform(0, 2), free_length=0.3)
    b.force("spring", law, between=(("ground", (0.1, 0.2, 0.9)), "two"))
    system = alike("loop", lambda like: b.build(like=like, independent=None if like else ["j0"]))
    assert system.topology.mobility == 1
    return system, mbs.State.at(system, j0=0.0, velocities={"j0": 1.0})


@jax.jit
def gaps(system, state):
    """What must vanish at every state, each relative to its own size."""
    at, top = at_state(system, state), system.topology
    psi, u, t = state.coordinates, state.velocities, state.t
    u_dot, multipliers = mbs.forward_dynamics(system, state)
    psi_dot = coordinate_rate(top, psi, u)

    def energy(psi, u):
        moved = mbs.State(t, psi, u)
        return mbs.dynamics.kinetic_energy(system, moved) + mbs.dynamics.potential_energy(system, moved)

    rate = jax.jvp(energy, (psi, u), (psi_dot, u_dot))[1]
    power = jnp.sum(efforts(system, with_velocities(system, at, u))[2])
    scale = jnp.sum(jnp.abs(mbs.mass_matrix(system, state))) * jnp.max(jnp.abs(u)) * (1.0 + jnp.max(jnp.abs(u_dot)))

    def momentum(psi, u):
        return momenta(system, with_velocities(system, at_coordinates(system, at, psi), u))

    h, momentum_rate = jax.jvp(momentum, (psi, u), (psi_dot, u_dot))
    pull = mbs.constraints.constraint_jacobian(system, state).T @ multipliers
    canonical = canonical_rate(system, at, h)[1]

    K = mbs.constraints.kic(system, state)
    phi_dot = u[independent_columns(system)]
    by_kic = jnp.stack([K.translational[name] @ phi_dot for name in top.body_names])

    def centres(psi):
        moved = mbs.State(t, psi, u)
        R = jnp.stack([mbs.rotation(system, moved, name) for name in top.body_names])
        x = jnp.stack([mbs.position(system, moved, name) for name in top.body_names])
        return x + jnp.einsum("bij,bj->bi", R, system.com)

    by_difference = jax.jvp(centres, (psi,), (psi_dot,))[1]
    return {
        "power": jnp.abs(rate - power) / scale,
        "momentum": jnp.max(jnp.abs(momentum_rate - canonical - pull)) / jnp.max(jnp.abs(momentum_rate)),
        "kic": jnp.max(jnp.abs(by_kic - by_difference)) / jnp.max(jnp.abs(by_difference)),
    }


@pytest.mark.parametrize(
    "model", [pytest.param(tree, marks=pytest.mark.long), pytest.param(loop, marks=pytest.mark.long)]
)
@MANY
@given(seed=SEEDS)
def test_power_momentum_and_influence_coefficients(model, seed):
    """Energy changes by the elements' power; both sets of equations agree; the KIC are derivatives of positions."""
    for name, gap in gaps(*model(seed)).items():
        assert gap < 1e-8, f"{name}: {gap:.1e}"


@jax.jit
def total_momentum_rates(system, state):
    """Rates of the momentum and of the angular momentum about the world origin."""
    top, t = system.topology, state.t

    def total(psi, u):
        moved = mbs.State(t, psi, u)
        momentum = moment = jnp.zeros(3)
        for k, name in enumerate(top.body_names):
            R, com = mbs.rotation(system, moved, name), system.com[k]
            x = mbs.position(system, moved, name) + R @ com
            w = mbs.kinematics.angular_velocity(system, moved, name)
            v = mbs.velocity(system, moved, name) + jnp.cross(w, R @ com)
            momentum = momentum + system.mass[k] * v
            moment = moment + system.mass[k] * jnp.cross(x, v) + R @ (system.inertia[k] @ (R.T @ w))
        return jnp.concatenate([momentum, moment])

    u_dot = mbs.forward_dynamics(system, state)[0]
    moving = (coordinate_rate(top, state.coordinates, state.velocities), u_dot)
    return jax.jvp(total, (state.coordinates, state.velocities), moving)[1], jnp.max(jnp.abs(u_dot))


@pytest.mark.long
@MANY
@given(seed=SEEDS)
def test_momenta_of_a_floating_tree_are_kept(seed):
    random = np.random.default_rng(seed)
    kinds = [mbs.Free(), mbs.Revolute(axis=axis(random)), mbs.Spherical()]
    links = random_links(seed, kinds, parents=(-1, 0, 1))
    system = alike("floating", lambda like: build(links, (0.0, 0.0, 0.0), like))
    rates, size = total_momentum_rates(system, random_state(system, seed))
    assert np.max(np.abs(rates)) < 1e-10 * (1.0 + float(size)) * float(jnp.sum(system.mass))


@pytest.mark.long
@MANY
@given(seed=SEEDS)
def test_accelerations_do_not_depend_on_the_world_frame(seed):
    """Turning and shifting the ground frame and gravity together changes no joint acceleration."""
    random = np.random.default_rng(seed)
    links = random_links(seed, [mbs.Revolute(axis="y"), mbs.Prismatic(axis="x"), mbs.Spherical()], (-1, 0, 1))
    turn = Rotation.random(random_state=random).as_matrix(), random.normal(size=3)
    gravity = random.normal(size=3) * 5.0
    here = alike("turned", lambda like: build(links, gravity, like))
    links[0].parent_frame = after(turn, links[0].parent_frame)
    there = build(links, turn[0] @ gravity, LIKE["turned"])
    state = random_state(here, seed)
    np.testing.assert_allclose(accelerations(here, state), accelerations(there, state), rtol=1e-8, atol=1e-8)


@jax.jit
def accelerations(system, state):
    return mbs.forward_dynamics(system, state)[0]


@jax.jit
def slopes(system, state, direction):
    """Derivative of one acceleration by all masses: forward and reverse mode, central differences."""

    def first(mass):
        return accelerations(dataclasses.replace(system, mass=mass), state)[0]

    h = 1e-3
    forward = jax.jvp(first, (system.mass,), (direction,))[1]
    reverse = jnp.dot(jax.grad(first)(system.mass), direction)
    at = [first(system.mass + k * h * direction) for k in (1, -1, 2, -2)]
    return forward, reverse, (8 * (at[0] - at[1]) - (at[2] - at[3])) / (12 * h)


@pytest.mark.parametrize(
    "model", [pytest.param(tree, marks=pytest.mark.long), pytest.param(loop, marks=pytest.mark.long)]
)
@settings(max_examples=8, deadline=None, derandomize=True)
@given(seed=SEEDS)
def test_derivatives_by_mass(model, seed):
    system, state = model(seed)
    direction = jnp.asarray(np.random.default_rng(seed).uniform(-0.3, 0.3, size=system.mass.shape))
    forward, reverse, difference = slopes(system, state, direction)
    np.testing.assert_allclose(forward, reverse, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(forward, difference, rtol=1e-5, atol=1e-6)
