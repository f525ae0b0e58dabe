"""Dynamics of random trees against Pinocchio, and the size of the compiled program."""

import jax
import jax.numpy as jnp
import numpy as np
import pinocchio as pin
import pytest

import jaxmbs as mbs
from tests import random_systems as rs
from tests.models import four_bar_angles

AXES = ((1.0, 0.2, -0.4), (0.0, 1.0, 0.0), (-0.3, 0.1, 1.0))
KINDS = {
    "simple": [mbs.Revolute(axis=AXES[0]), mbs.Prismatic(axis=AXES[1]), mbs.Revolute(axis=AXES[2])] * 3,
    "balls": [mbs.Spherical(), mbs.Revolute(axis=AXES[0]), mbs.Prismatic(axis=AXES[2]), mbs.Spherical()] * 2,
}
jitted = jax.jit(
    lambda system, state, a: (
        mbs.forward_dynamics(system, state)[0],
        mbs.inverse_dynamics(system, state, a),
        mbs.mass_matrix(system, state),
    )
)


@pytest.mark.long
@pytest.mark.parametrize("kinds, seed", [("simple", 0), ("simple", 1), ("balls", 2)])
def test_random_trees_against_pinocchio(kinds, seed):
    links = rs.random_links(seed, KINDS[kinds])
    system, model = rs.build(links), rs.pinocchio_model(links)
    state = rs.random_state(system, seed)
    q, u = rs.pinocchio_coordinates(links, np.asarray(state.coordinates)), np.asarray(state.velocities)
    a = np.random.default_rng(seed).normal(size=u.size)
    data = model.createData()
    forward, inverse, mass = jitted(system, state, jnp.asarray(a))
    np.testing.assert_allclose(forward, pin.aba(model, data, q, u, np.zeros_like(u)), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(inverse, pin.rnea(model, data, q, u, a), rtol=1e-9, atol=1e-9)
    M = np.triu(pin.crba(model, data, q))
    np.testing.assert_allclose(mass, M + np.triu(M, 1).T, rtol=1e-10, atol=1e-10)


@pytest.mark.slow
def test_inverse_dynamics_undoes_forward_dynamics_with_forces():
    """Applied efforts move the tree by M^-1 times themselves; springs and loads enter both alike."""
    links = rs.random_links(0, KINDS["simple"])
    system = rs.build(links)
    state = rs.random_state(system, 0)
    forward, _, mass = jitted(system, state, jnp.zeros(9))
    needed = mbs.inverse_dynamics(system, state, forward + jnp.ones(9))
    np.testing.assert_allclose(needed, np.asarray(mass) @ np.ones(9), rtol=1e-9, atol=1e-9)


@pytest.mark.long
def test_kinetic_energy_is_half_the_momentum_times_the_velocity():
    links = rs.random_links(2, KINDS["balls"])
    system, model = rs.build(links), rs.pinocchio_model(links)
    state = rs.random_state(system, 2)
    q, u = rs.pinocchio_coordinates(links, np.asarray(state.coordinates)), np.asarray(state.velocities)
    data = model.createData()
    kinetic = pin.computeKineticEnergy(model, data, q, u)
    np.testing.assert_allclose(mbs.dynamics.kinetic_energy(system, state), kinetic, rtol=1e-12)
    np.testing.assert_allclose(
        mbs.dynamics.potential_energy(system, state), pin.computePotentialEnergy(model, data, q), rtol=1e-12
    )


def _program(n, branched):
    parents = tuple(-1 if k == 0 else (k - 1) // 2 * 2 if branched else k - 1 for k in range(n))
    b = mbs.SystemBuilder()
    for k in range(n):
        b.body(f"b{k}", mass=1.0, com=(0.1, 0.0, 0.0), inertia=0.01 * np.ones(3))
        parent = "ground" if parents[k] < 0 else f"b{parents[k]}"
        b.joint(f"j{k}", mbs.Revolute(axis="y"), parent, f"b{k}", parent_frame=(0.2, 0.0, 0.0))
    system = b.build()
    state = mbs.State(jnp.zeros(()), jnp.zeros(n), jnp.zeros(n))
    value = jax.jit(lambda s, x: mbs.forward_dynamics(s, x)[0]).lower(system, state)
    gradient = jax.jit(jax.grad(lambda s, x: jnp.sum(mbs.forward_dynamics(s, x)[0]))).lower(system, state)
    return [len(lowered.as_text().splitlines()) for lowered in (value, gradient)]


@pytest.mark.long
@pytest.mark.parametrize("branched", [False, True], ids=["chain", "branched"])
def test_the_program_does_not_grow_with_the_tree(branched):
    """As many operations for 80 bodies as for 20, forward and reverse; up to a dozen take their sums by products."""
    assert _program(20, branched) == _program(80, branched)


def two_loops(ratio):
    """Two four-bars that share nothing; the second has the masses of the first times `ratio`."""
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    pin, lengths = mbs.Revolute(axis="z"), {"crank": 0.3, "coupler": 0.9, "rocker": 0.7}
    for k, mass in enumerate((1000.0, 1000.0 * ratio)):
        for name, length in lengths.items():
            inertia = mass * np.array([0.01, 0.1, 0.1])
            b.body(f"{name}_{k}", mass=mass, com=(length / 2, 0.0, 0.0), inertia=inertia)
        b.joint(f"A{k}", pin, "ground", f"crank_{k}")
        b.joint(f"B{k}", pin, f"crank_{k}", f"coupler_{k}", parent_frame=(0.3, 0.0, 0.0))
        b.joint(f"D{k}", pin, "ground", f"rocker_{k}", parent_frame=(1.0, 0.0, 0.0))
        ends = {"parent_frame": (0.9, 0.0, 0.0), "child_frame": (0.7, 0.0, 0.0)}
        b.joint(f"C{k}", pin, f"coupler_{k}", f"rocker_{k}", **ends)
    return b.build()


@pytest.mark.long
@pytest.mark.parametrize("ratio", [1e-3, 1e-6, 1e-8])
def test_light_and_heavy_loops_move_alike(ratio):
    """Accelerations under gravity do not depend on the scale of the masses."""
    system = two_loops(ratio)
    _, B, D = four_bar_angles(0.7)
    guess = {f"{n}{k}": v for k in range(2) for n, v in (("A", 0.7), ("B", B), ("D", D))}
    state = mbs.State.at(system, {"A0": 0.7, "A1": 0.7}, velocities={"A0": 2.0, "A1": 2.0}, guess=guess)
    heavy, light = np.asarray(mbs.forward_dynamics(system, state)[0]).reshape(2, 3)
    np.testing.assert_allclose(heavy, light, rtol=1e-8)
