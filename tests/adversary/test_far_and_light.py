"""Digits that places and masses must not take: far from the world origin, light beside heavy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.models import PIN, rotation_about

OUT = np.array([0.6, -0.64, 0.48])


def satellite(gravity=(0.0, 0.0, 0.0)):
    """A free body with an arm on a skew hinge, and a spring between them."""
    b = mbs.SystemBuilder(gravity=gravity)
    b.body("bus", 3.0, (0.05, 0.02, -0.03), (0.3, 0.2, 0.4))
    b.body("arm", 1.0, (0.4, 0.0, 0.1), (0.01, 0.08, 0.08))
    b.joint("free", mbs.Free(), "ground", "bus")
    b.joint("hinge", mbs.Revolute((0.2, 0.9, -0.3)), "bus", "arm", parent_frame=(0.3, 0.1, 0.0))
    b.force(
        "spring",
        mbs.SpringDamper(stiffness=20.0, damping=0.3, free_length=0.2),
        between=("bus", ("arm", (0.8, 0, 0))),
    )
    b.force("thrust", mbs.Force((1.0, 2.0, -0.5)), on=("arm", (0.8, 0.0, 0.0)))
    return b.build()


def moved(system, distance):
    at = np.r_[distance * OUT, 0.8, 0.1, -0.5, 0.2]
    at[3:] /= np.linalg.norm(at[3:])
    state = mbs.State.at(system, free=at, hinge=0.4)
    return mbs.State(state.t, state.coordinates, jnp.array([1.0, -2.0, 0.5, 0.4, 0.9, -0.3, 1.5]))


@pytest.mark.long
@pytest.mark.parametrize("distance, digits", [(1e3, 1e-12), (1e5, 1e-10), (7e6, 1e-7)])
def test_a_satellite_far_out_moves_as_at_home(distance, digits):
    system = satellite()
    home, away = (moved(system, d) for d in (0.0, distance))
    expected = mbs.forward_dynamics(system, home)[0]
    scale = np.max(np.abs(expected))
    np.testing.assert_allclose(mbs.forward_dynamics(system, away)[0], expected, atol=digits * scale)
    load, there = (mbs.reactions(system, s)["hinge"] for s in (home, away))
    np.testing.assert_allclose(there.force, load.force, atol=digits * 10)
    np.testing.assert_allclose(there.moment, load.moment, atol=digits * 10)
    acceleration = mbs.dynamics.acceleration(system, home, ("arm", (0.8, 0.0, 0.0)))
    np.testing.assert_allclose(
        mbs.dynamics.acceleration(system, away, ("arm", (0.8, 0.0, 0.0))), acceleration, atol=100 * digits
    )


@pytest.mark.long
def test_slopes_by_place_are_those_of_the_world():
    """The point that all refers to stands still in derivatives; weight and its energy know where it is."""
    system = satellite((0.0, 0.0, -9.81))
    state = moved(system, 100.0)

    def at(psi):
        return mbs.State(state.t, psi, state.velocities)

    slope = jax.jit(jax.grad(lambda psi: mbs.dynamics.potential_energy(system, at(psi))))(state.coordinates)
    np.testing.assert_allclose(slope[:3], [0.0, 0.0, 4.0 * 9.81], atol=1e-9)
    height = mbs.dynamics.potential_energy(system, state) - mbs.dynamics.potential_energy(system, moved(system, 0.0))
    np.testing.assert_allclose(height, 4.0 * 9.81 * 100.0 * OUT[2], rtol=1e-12)
    forward = jax.jit(jax.jacfwd(lambda psi: mbs.forward_dynamics(system, at(psi))[0]))(state.coordinates)
    for k in range(7):
        step = 1e-5 * np.eye(len(state.coordinates))[k]
        ahead, behind = (mbs.forward_dynamics(system, at(state.coordinates + s))[0] for s in (step, -step))
        np.testing.assert_allclose(forward[:, k], (ahead - behind) / 2e-5, atol=2e-6)


@pytest.mark.long
def test_a_motion_far_out_takes_the_steps_of_home():
    system = satellite()
    motions = [mbs.simulate(system, moved(system, d), ts=[0.0, 2.0]) for d in (0.0, 1e4)]
    steps = [int(m.diagnostics.num_steps + m.diagnostics.num_rejected) for m in motions]
    assert steps[1] <= 1.2 * steps[0]
    np.testing.assert_allclose(motions[1].states.coordinates[:, 3:], motions[0].states.coordinates[:, 3:], atol=1e-6)


@pytest.mark.long
def test_a_body_force_sees_its_place_in_the_world():
    """A spring to the world origin, written by the user as a load at a frame."""

    class Tether(mbs.forces.AbstractBodyLaw):
        def wrench(self, rotation, position, angular_velocity, velocity, t):
            return -2.0 * position, jnp.zeros(3)

        def potential(self, rotation, position, t):
            return jnp.dot(position, position)

    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("bob", 4.0, inertia=np.ones(3))
    b.joint("free", mbs.Free(), "ground", "bob")
    b.force("tether", Tether(), on="bob")
    system = b.build()
    state = mbs.State.at(system, free=[3.0, -1.0, 2.0, 1.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(mbs.forward_dynamics(system, state)[0][:3], [-1.5, 0.5, -1.0], atol=1e-12)
    np.testing.assert_allclose(mbs.dynamics.potential_energy(system, state), 14.0, rtol=1e-12)


def branches(heavy):
    """A light arm of two links on the ground, alone or beside ten tonnes that swing on their own."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    if heavy:
        b.body("crane", 1e4, (0.0, 0.0, 5.0), (1e5, 2e5, 3e5), position=None)
        b.joint("slew", mbs.Revolute((0.1, 0.2, 1.0)), "ground", "crane", parent_frame=(20.0, -30.0, 5.0))
    b.body("upper", 1e-3, (0.05, 0.0, 0.0), (1e-8, 1e-6, 1e-6))
    b.body("lower", 1e-3, (0.05, 0.0, 0.0), (1e-8, 1e-6, 1e-6))
    place = mbs.Pose((0.1, 0.2, 0.0), rotation_about((0.0, 1.0, 0.0), 0.3))
    b.joint("A", PIN, "ground", "upper", parent_frame=place)
    b.joint("B", mbs.Revolute("y"), "upper", "lower", parent_frame=(0.1, 0.0, 0.0))
    if heavy:
        b.body("tower", 1e4, (0.0, 0.0, 5.0), (1e5, 2e5, 3e5))
        b.joint("lean", mbs.Revolute("x"), "ground", "tower")
    return b.build()


@pytest.mark.long
def test_a_light_branch_keeps_its_digits_beside_a_heavy_one():
    """All refers to the crane, 36 m away from an arm of 0.1 m: (36 / 0.1)^2 roundings, and none of ten tonnes."""
    alone, beside = branches(False), branches(True)
    rates = {"A": 3.0, "B": -5.0}
    one = mbs.State.at(alone, A=0.3, B=0.7, velocities=rates)
    two = mbs.State.at(beside, A=0.3, B=0.7, slew=0.4, lean=0.2, velocities=rates | {"slew": 2.0, "lean": 1.0})
    columns = [beside.topology.joints[beside.topology.joint_index[n]].first_velocity for n in ("A", "B")]

    def both(question):
        return question(alone, one), np.asarray(question(beside, two))[..., columns]

    ours, theirs = both(lambda s, x: mbs.forward_dynamics(s, x)[0])
    np.testing.assert_allclose(theirs, ours, rtol=1e-10)
    ours, theirs = both(lambda s, x: mbs.inverse_dynamics(s, x, jnp.ones(s.topology.num_velocities)))
    np.testing.assert_allclose(theirs, ours, rtol=1e-10)
    ours, theirs = mbs.mass_matrix(alone, one), mbs.mass_matrix(beside, two)[np.ix_(columns, columns)]
    np.testing.assert_allclose(theirs, ours, atol=1e-10 * np.max(ours))
