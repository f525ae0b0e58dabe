"""Mechanisms small enough to be judged by hand, at which the library was caught once."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.vibration._modes import natural_modes
from tests.models import PIN, four_bar, four_bar_angles


def door(hinges, axis=(1.0, 2.0, 3.0)):
    """A door on hinges in line."""
    b, along = mbs.SystemBuilder(), np.array(axis) / np.linalg.norm(axis)
    b.body("door", mass=2.0, com=(0.4, 0.1, 0.3), inertia=0.1)
    for k in range(hinges):
        ends = {"parent_frame": 0.7 * k * along, "child_frame": 0.7 * k * along}
        b.joint(f"hinge {k}", mbs.Revolute(axis=axis), "ground", "door", **ends)
    system = b.build()
    state = mbs.State.at(system, {"hinge 0": 0.3})
    return system.topology.mobility, np.asarray(mbs.forward_dynamics(system, state)[0])


@pytest.mark.long
def test_a_door_on_two_hinges_swings_like_one_on_one():
    (one, single), (two, double) = door(1), door(2)
    assert one == two == 1
    np.testing.assert_allclose(double, single, rtol=1e-9)


def crank_at_rest(lengths, masses, q):
    """Acceleration of a four-bar's crank at rest under its weight, from the kinetic energy of unit crank rate."""
    _, a, b, c = lengths
    angles = np.array([q[0], q[0] + q[1], q[2]])
    across = np.stack([-np.sin(angles), np.cos(angles)], axis=1)
    w2, w3 = np.linalg.solve(np.stack([b * across[1], -c * across[2]], axis=1), -a * across[0])
    v = np.array([a / 2 * across[0], a * across[0] + b / 2 * w2 * across[1], c / 2 * w3 * across[2]])
    turning = masses * np.array([a, b * w2, c * w3]) ** 2 / 12.0
    return -9.81 * (masses @ v[:, 1]) / (masses @ np.sum(v**2, axis=1) + turning.sum())


@pytest.fixture(scope="module")
def released():
    """Acceleration of the crank at rest, by both methods the reactions' residual and the force on the ground."""
    like = four_bar()

    @jax.jit
    def at_rest(lengths, masses, q):
        system = four_bar(tuple(lengths), tuple(masses), like=like)
        state = mbs.State(jnp.zeros(()), q, jnp.zeros(3))
        loads = [mbs.reactions(system, state, method=m) for m in ("dense", "block-sparse")]
        return mbs.forward_dynamics(system, state)[0][0], [(x.ok, x.residual, x["A"].force) for x in loads]

    return at_rest


WIDE = [  # lengths, masses, and the methods that lose too many digits and say so
    ((1.0, 0.3, 0.9, 0.7), (1e-3, 1.0, 1e3), ()),
    ((1.0, 0.3, 0.9, 0.7), (1e6, 1e-6, 1.0), ()),
    ((1.0, 0.3, 0.9, 0.7), (1e-6, 1.0, 1e6), ()),
    ((1.0, 1e-3, 0.9, 0.7), (1.0, 1.0, 1.0), ()),
    ((1.0, 1e-4, 0.9, 0.7), (1.0, 1.0, 1.0), ("dense",)),
]


@pytest.mark.long
@pytest.mark.parametrize("lengths, masses, lost", WIDE)
def test_four_bars_of_wide_numbers(released, lengths, masses, lost):
    """Right to eight digits, by both methods alike; or not called ok."""
    q = four_bar_angles(0.7, lengths)
    found, loads = released(np.array(lengths), np.array(masses), q)
    weight = 9.81 * sum(masses)
    for method, (ok, residual, _) in zip(("dense", "block-sparse"), loads, strict=True):
        assert ok != (method in lost)
        assert method in lost or residual < 1e-8 * weight
    if "dense" not in lost:
        np.testing.assert_allclose(found, crank_at_rest(lengths, np.array(masses), q), rtol=1e-8)
    if not lost:
        np.testing.assert_allclose(loads[0][2], loads[1][2], atol=1e-8 * weight)


@pytest.mark.long
def test_marks_follow_the_axes_of_the_design():
    """`unique_force` is in the axes asked, at the state asked: a design that turns the frames of a ball in a planar
    loop has other marks in the joint's axes than the one it is built like, and the same in the world."""

    def loop(turn):
        b, place = mbs.SystemBuilder(), lambda p: mbs.Pose(p, turn)
        for name in ("crank", "coupler", "rocker"):
            b.body(name, mass=1.0, com=(0.3, 0.0, 0.1), inertia=0.1)
        b.joint("A", PIN, "ground", "crank")
        b.joint("B", mbs.Spherical(), "crank", "coupler", place((0.3, 0.0, 0.0)), place((0.0, 0.0, 0.0)))
        b.joint("D", PIN, "ground", "rocker", parent_frame=(1.0, 0.0, 0.0))
        b.joint("C", PIN, "coupler", "rocker", parent_frame=(0.9, 0.0, 0.0), child_frame=(0.7, 0.0, 0.0))
        return b

    tilted = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    plain, turned = loop(np.eye(3)).build(), loop(tilted).build()
    unique = lambda s, frame: list(mbs.reactions(s, mbs.State.at(s, A=0.7), frame)["B"].unique_force)
    for system, marks in ((plain, [True, True, False]), (turned, [False, True, True])):
        assert unique(system, "joint") == marks and unique(system, "world") == [True, True, False]
    assert unique(loop(tilted).build(like=plain), "joint") == unique(turned, "joint")


def test_a_negative_stiffness_is_no_rigid_mode():
    """An unstable structure is refused, or said to be unstable."""
    try:
        modes = natural_modes(K=jnp.diag(jnp.array([-0.5, 1.0, 2.0])), M=jnp.eye(3))
    except ValueError:
        return
    assert not modes.is_rigid[0]
