"""States of mechanisms with elastic bodies: joints close the loops, deformations stay where joints alone can."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.forces import BeamSection
from tests.flexible.beams import elastic_beam
from tests.models import four_bar_angles

GROUND, CRANK, COUPLER, ROCKER = LENGTHS = (1.0, 0.3, 0.9, 0.7)
GUESS = {"B": -0.2, "D": 1.2}  # some 0.2 m from closed
RATE = 3.0
X = np.array([1.0, 0.0, 0.0])


def four_bar(kind, elements=1):
    """A four-bar with a coupler that is a beam or an elastic body, whose loop is cut at C."""
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    for name, length in (("crank", CRANK), ("rocker", ROCKER)):
        b.body(name, mass=1.0, com=X * length / 2, inertia=mbs.inertia.rod(1.0, length))
    if kind == "beam":
        section = BeamSection([1e7, 5e6, 5e6, 1e3, 1e3, 1e3], 1.0, [1e-4, 1e-4, 1e-4])
        b.beam("coupler", section, [0.0 * X, COUPLER * X], elements)
    else:
        body = elastic_beam(COUPLER, 4).body
        b.elastic("coupler", body, motions={body.interfaces[1]: mbs.Planar("z")})
        elements = body.interfaces[1]
    start = "coupler.0" if kind == "beam" else f"coupler.{body.interfaces[0]}"
    b.joint("A", mbs.Revolute("z"), "ground", "crank")
    b.joint("B", mbs.Revolute("z"), "crank", start, parent_frame=CRANK * X)
    b.joint("D", mbs.Revolute("z"), "ground", "rocker", parent_frame=GROUND * X)
    b.joint("C", mbs.Revolute("z"), f"coupler.{elements}", "rocker", child_frame=ROCKER * X)
    return b.build(cut=["C"])


def joint_rates(system, state):
    return jnp.stack(
        [state.velocities[system.topology.joints[system.topology.joint_index[n]].velocities][0] for n in "ABD"]
    )


def joint_angles(system, state):
    values = system.coordinates(state)
    return jnp.stack([jnp.asarray(values[n]) for n in "ABD"])


def rigid_rates(angle):
    step = 1e-6
    ends = [np.array(four_bar_angles(angle + way)) for way in (step, -step)]
    return RATE * (ends[0] - ends[1]) / (2 * step)


def check_undeformed(system, state):
    """All coordinates of deformations are those of the body without load, and all of their rates vanish."""
    top = system.topology
    for joint in top.joints:
        if joint.is_elastic:
            values = np.asarray(state.coordinates[..., joint.coordinates])
            is_free = joint.num_coordinates > joint.num_velocities
            rest = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0] if is_free else np.zeros(joint.num_coordinates)
            np.testing.assert_allclose(values, np.broadcast_to(rest, values.shape), atol=1e-12)
            np.testing.assert_allclose(state.velocities[..., joint.velocities], 0.0, atol=1e-12)


@pytest.mark.long
def test_a_beam_in_a_loop_keeps_its_shape():
    system = four_bar("beam")
    state = mbs.State.at(system, A=0.7, guess=GUESS, velocities={"A": RATE})
    check_undeformed(system, state)
    np.testing.assert_allclose(joint_angles(system, state), four_bar_angles(0.7), atol=1e-11)
    np.testing.assert_allclose(joint_rates(system, state), rigid_rates(0.7), rtol=1e-8)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["beam", "elastic"])
def test_deformations_stay_in_traces_along_branches_and_in_derivatives(kind):
    system = four_bar(kind)
    nominal = mbs.State.at(system, A=0.7, guess=GUESS, velocities={"A": RATE})

    def at(angle):
        return mbs.State.at(system, A=angle, guess=GUESS, velocities={"A": RATE})

    angles = jnp.array([0.5, 0.7, 0.9])
    many = jax.jit(jax.vmap(at))(angles)
    check_undeformed(system, many)
    for k, angle in enumerate(angles):
        one = jax.tree.map(lambda x, k=k: x[k], many)
        np.testing.assert_allclose(joint_angles(system, one), four_bar_angles(float(angle)), atol=1e-10)
        np.testing.assert_allclose(joint_rates(system, one), rigid_rates(float(angle)), rtol=1e-8)
    slope = jax.jacfwd(lambda angle: joint_angles(system, at(angle)))(0.7)
    np.testing.assert_allclose(RATE * slope, rigid_rates(0.7), rtol=1e-8)
    followed = mbs.State.at(system, near=nominal, A=1.2)
    check_undeformed(system, followed)
    np.testing.assert_allclose(joint_angles(system, followed), four_bar_angles(1.2), atol=1e-9)


@pytest.mark.long
def test_deformations_close_what_joints_cannot():
    """With all three joints given the coupler reaches from pin to pin, host and trace alike."""
    system = four_bar("beam")
    angles = {"A": 0.7, "B": -0.1, "D": 1.6}

    def at(scale):
        return mbs.State.at(system, {name: scale * angle for name, angle in angles.items()})

    for state in (at(1.0), jax.jit(at)(1.0)):
        np.testing.assert_allclose(joint_angles(system, state), list(angles.values()), atol=1e-12)
        tip = CRANK * np.array([np.cos(0.7), np.sin(0.7)])
        pin = np.array([GROUND + ROCKER * np.cos(1.6), ROCKER * np.sin(1.6)])
        start, end = (np.asarray(mbs.position(system, state, name))[:2] for name in ("coupler.0", "coupler.1"))
        np.testing.assert_allclose(start, tip, atol=1e-12)
        np.testing.assert_allclose(end, pin, atol=1e-9)
