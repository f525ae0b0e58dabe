"""Local stiffness: Hessian of the potential on the constraint manifold, its shares, preload that makes unstable."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.assembly._assembly import assemble_coordinates
from jaxmbs.constraints._kic import independent_columns
from jaxmbs.kinematics._poses import node_parameters
from tests.cases import models
from tests.models import OnCart, four_bar_angles, slopes

PIN = mbs.Revolute(axis="z")


def sprung_four_bar(preload=0.3):
    """A planar four-bar with a joint spring, a redundant preloaded spring between points, gravity and a bushing."""
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    for name, length in (("crank", 0.3), ("coupler", 0.9), ("rocker", 0.7)):
        b.body(name, mass=length, com=(length / 2, 0.0, 0.0), inertia=0.1 * length)
    b.joint("A", PIN, "ground", "crank")
    b.joint("B", PIN, "crank", "coupler", parent_frame=(0.3, 0.0, 0.0))
    b.joint("D", PIN, "ground", "rocker", parent_frame=(1.0, 0.0, 0.0))
    b.joint("C", PIN, "coupler", "rocker", parent_frame=(0.9, 0.0, 0.0), child_frame=(0.7, 0.0, 0.0))
    b.force("torsion", mbs.SpringDamper(stiffness=12.0, free_length=0.4), joint="B")
    law = mbs.SpringDamper(stiffness=80.0, damping=3.0, free_length=preload)
    b.force("cross", law, between=(("ground", (0.4, 0.6, 0.0)), ("coupler", (0.45, 0.1, 0.0))))
    b.force("mount", mbs.Bushing(np.array([60.0, 70.0, 80.0, 3.0, 4.0, 5.0])), between=("crank", "rocker"))
    return b.build()


@pytest.mark.long
def test_total_is_the_hessian_on_the_constraint_manifold():
    """Second derivative of the potential along assembled positions of one independent coordinate."""
    system = sprung_four_bar()
    _, B, D = four_bar_angles(0.7)
    state = mbs.State.at(system, A=0.7, guess={"B": B, "D": D})
    (column,) = independent_columns(system)
    P, free = node_parameters(system), jnp.ones(3).at[column].set(0.0)

    def energy(x):
        psi = assemble_coordinates(system, P, state.coordinates.at[column].add(x), state.t, free)
        return mbs.dynamics.potential_energy(system, mbs.State(state.t, psi, state.velocities))

    K = mbs.stiffness(system, state)
    slope, h = jax.jit(jax.jacfwd(energy)), 1e-3
    hessian = (8 * (slope(h) - slope(-h)) - (slope(2 * h) - slope(-2 * h))) / (12 * h)
    np.testing.assert_allclose(K.total[0, 0], hessian, rtol=1e-8)
    np.testing.assert_allclose(K.sources, 0.0, atol=1e-10)
    linear = mbs.linearise(system, state)  # at rest, though not in balance: the shares sum to the same
    np.testing.assert_allclose(K.total, np.asarray(linear.stiffness) - held(system, state), rtol=1e-8)


def held(system, state):
    """What the held accelerations add to the stiffness of `linearise`: d(I*)/dphi a."""
    (column,) = independent_columns(system)
    a = mbs.forward_dynamics(system, state)[0][column]
    H = mbs.constraints.kic_second(system, state)
    K = mbs.constraints.kic(system, state)
    rate = sum(
        m * H.translational[n][0, :, 0] @ K.translational[n][:, 0]
        + H.rotational[n][0, 2, 0] * K.rotational[n][2, 0] * 0.1 * m
        for n, m in (("crank", 0.3), ("coupler", 0.9), ("rocker", 0.7))
    )
    return 2.0 * rate * a


def antagonists(tension, width=0.1, length=0.5):
    """A bar on a pin, hanging sideways in two springs along it from both ends: tension stiffens it, push buckles."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("bar", mass=1.0, com=(width, 0.0, 0.0), inertia=0.01)
    b.joint("pin", PIN, "ground", "bar")
    law = mbs.SpringDamper(stiffness=1000.0, free_length=length - width - tension / 1000.0)
    b.force("pull", law, between=(("ground", (length, 0.0, 0.0)), ("bar", (width, 0.0, 0.0))))
    return b.build()


@pytest.mark.long
def test_preload_changes_stiffness_by_the_closed_form():
    """A radial spring has no elastic share; its tension T gives K = T a L / (L - a), negative when it pushes."""
    for tension in (50.0, -50.0):
        system = antagonists(tension)
        K = mbs.stiffness(system, mbs.State.at(system))
        np.testing.assert_allclose(K.elastic, 0.0, atol=1e-12)
        np.testing.assert_allclose(K.antagonistic, [[tension * 0.1 * 0.5 / 0.4]], rtol=1e-10)


@pytest.mark.long
def test_actuators_that_push_against_each_other_stiffen():
    """Redundant actuation: equal torques at opposite joints of a four-bar, without springs; -d(Gamma^T tau)/dphi."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    for name, length in (("crank", 0.3), ("coupler", 0.9), ("rocker", 0.7)):
        b.body(name, mass=length, com=(length / 2, 0.0, 0.0), inertia=0.1 * length)
    b.joint("A", PIN, "ground", "crank")
    b.joint("B", PIN, "crank", "coupler", parent_frame=(0.3, 0.0, 0.0))
    b.joint("D", PIN, "ground", "rocker", parent_frame=(1.0, 0.0, 0.0))
    b.joint("C", PIN, "coupler", "rocker", parent_frame=(0.9, 0.0, 0.0), child_frame=(0.7, 0.0, 0.0))
    b.force("crank_motor", mbs.Actuator(lambda x, v, t: 2.0), joint="A")
    b.force("rocker_motor", mbs.Actuator(lambda x, v, t: 3.0), joint="D")
    system = b.build(independent=["A"])
    _, B, D = four_bar_angles(0.7)
    state = mbs.State.at(system, A=0.7, guess={"B": B, "D": D})
    h = 1e-5
    slopes = [(four_bar_angles(0.7 + x + h)[2] - four_bar_angles(0.7 + x - h)[2]) / (2 * h) for x in (-1e-3, 1e-3)]
    K = mbs.stiffness(system, state)
    np.testing.assert_allclose(K.sources, [[-3.0 * (slopes[1] - slopes[0]) / 2e-3]], rtol=1e-4)
    np.testing.assert_allclose(K.elastic + K.antagonistic, 0.0, atol=1e-12)


@pytest.mark.long
def test_gough_platform_of_the_case():
    """C4: passive stiffness of six legs of 1e6 N/m without preload, world axes, at the platform's origin."""
    system = models.gough_platform("spring", stiffness=1e6)
    state = mbs.State.at(system, platform=models.gough_pose())
    K = mbs.stiffness(system, state)
    turn = np.eye(6)
    turn[3:, 3:] = models.GOUGH_ROTATION  # our angular velocities stand in the platform's axes
    world = turn @ np.asarray(K.elastic) @ turn.T
    diagonal = (929998.4004796125, 931565.392981014, 4138436.206539373, 734805.9350086662, 744215.922548136)
    np.testing.assert_allclose(np.diag(world)[:5], diagonal, atol=1e-3)
    np.testing.assert_allclose(world[2, :2], (294445.5526594207, -138975.65052422232), atol=1e-3)
    np.testing.assert_allclose(world[5], GOUGH_LAST, atol=1e-3)
    np.testing.assert_allclose(K.antagonistic, 0.0, atol=1e-6 * np.abs(diagonal).max())


GOUGH_LAST = (
    65531.83375980187,
    -17938.696207427885,
    158085.89119342287,
    -50980.819576399495,
    -6651.6564531091,
    599545.7034100933,
)


HAND = OnCart()
AT, FREE, LINE, MOUNT = np.array([0.3, 0.6]), 0.3, 80.0, np.array([60.0, 70.0, 80.0, 3.0, 4.0, 5.0])
ON_GROUND, ON_BOB, HELD = np.array([0.5, 0.8, 0.1]), (0.05, -0.4, 0.02), np.array([0.3, 0.1, 0.05])


@pytest.mark.long
def test_every_share_by_hand():
    """A line spring, an uneven bushing whose first frame moves, a joint spring, gravity on a pendulum on a cart."""
    system = HAND.build(
        forces=[
            ("line", mbs.SpringDamper(LINE, free_length=FREE), {"between": (("ground", ON_GROUND), ("bob", ON_BOB))}),
            ("mount", mbs.Bushing(MOUNT), {"between": (("bob", (0.1, -0.2, 0.0)), ("ground", HELD))}),
            ("torsion", mbs.SpringDamper(12.0, free_length=0.4), {"joint": "swing"}),
            ("push", mbs.Force((0.0, 6.0, 0.0)), {"on": ("bob", (0.0, -0.5, 0.0))}),
        ]
    )
    K = mbs.stiffness(system, mbs.State.at(system, slide=AT[0], swing=AT[1]))

    def length(phi):
        return np.linalg.norm(HAND.place(phi, ON_BOB) - ON_GROUND)

    def seen(phi):
        """Displacement of the ground's frame from that of the bob, in its axes, then the turn about z."""
        away = HAND.turned(phi[1]).T @ (HELD - HAND.place(phi, (0.1, -0.2, 0.0)))
        return np.append(away, [0.0, 0.0, -phi[1]])

    def stored(phi):
        springs = LINE / 2 * (length(phi) - FREE) ** 2 + seen(phi) @ (MOUNT * seen(phi)) / 2
        return springs + 6.0 * (phi[1] - 0.4) ** 2

    G, g = slopes(seen, AT), slopes(length, AT)
    elastic = LINE * np.outer(g, g) + G.T @ (MOUNT[:, None] * G) + np.diag([0.0, 12.0])
    hessian = slopes(lambda phi: slopes(stored, phi, 1e-3), AT, 1e-3)
    np.testing.assert_allclose(K.elastic, elastic, rtol=1e-8)
    np.testing.assert_allclose(K.antagonistic, hessian - elastic, atol=1e-5)
    np.testing.assert_allclose(K.gravity, -slopes(lambda phi: HAND.weight(phi[1]), AT), atol=1e-8)
    lift = lambda phi: slopes(lambda phi: 6.0 * HAND.place(phi, (0.0, -0.5, 0.0))[1], phi, 1e-3)
    np.testing.assert_allclose(K.sources, -slopes(lift, AT, 1e-3), atol=1e-6)
    np.testing.assert_allclose(K.total, K.elastic + K.antagonistic + K.gravity + K.sources, rtol=1e-14)
    assert min(np.max(np.abs(share)) for share in (K.antagonistic, K.gravity, K.sources)) > 0.5


@pytest.mark.long
def test_a_spring_of_no_length_keeps_its_stiffness():
    """Its net force is zero, its KIC undefined; a point between two slides still feels K in both directions."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("carrier", mass=0.0)
    b.body("point", mass=1.0)
    b.joint("x", mbs.Prismatic("x"), "ground", "carrier")
    b.joint("y", mbs.Prismatic("y"), "carrier", "point")
    b.force("spring", mbs.SpringDamper(stiffness=50.0), between=("ground", "point"))
    system = b.build()
    np.testing.assert_allclose(mbs.stiffness(system, mbs.State.at(system)).total, 50.0 * np.eye(2), atol=1e-12)
