"""Spanning tree, cuts, bodies split by welds, frames and `at=`, equal topologies."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.models import DOWN_Y, PIN, four_bar, four_bar_angles, four_bar_state, rotation_about


@jax.jit
def body_motion(system, state):
    """Accelerations and reactions that do not depend on the choice of coordinates."""
    a = mbs.forward_dynamics(system, state)[0]
    loads = mbs.reactions(system, state)
    names = ("crank", "coupler", "rocker")
    accelerations = {
        n: (mbs.dynamics.acceleration(system, state, n, a), mbs.dynamics.angular_acceleration(system, state, n, a))
        for n in names
    }
    return accelerations, {n: (loads[n].force, loads[n].moment) for n in "ABCD"}


@pytest.fixture(scope="module")
def reference():
    system = four_bar()
    return body_motion(system, four_bar_state(system))


def test_declared_order_makes_the_tree():
    top = four_bar().topology
    assert top.body_names == ("crank", "coupler", "rocker")
    assert top.bodies.parent == (-1, 0, -1)
    assert top.cut_joints == ("C",)


def test_bodies_are_numbered_depth_first():
    b = mbs.SystemBuilder()
    for name, parent in (("a", "ground"), ("b", "ground"), ("c", "a"), ("d", "c"), ("e", "a"), ("f", "b")):
        b.body(name, mass=1.0, inertia=np.ones(3))
        b.joint(f"to_{name}", PIN, parent, name)
    top = b.build().topology
    assert top.body_names == ("a", "c", "d", "e", "b", "f")
    assert top.bodies.parent == (-1, 0, 1, 0, -1, 4)
    np.testing.assert_array_equal(top.bodies.end, [4, 3, 3, 4, 6, 6])


@pytest.mark.long
@pytest.mark.parametrize("cut", ["B", "A"])
def test_any_cut_gives_the_same_motion(cut, reference):
    system = four_bar(cut=(cut,))
    assert system.topology.cut_joints == (cut,)
    A, B, D = four_bar_angles(0.7)
    C = D - A - B  # along the coupler and back by the rocker, half a turn apart
    guess = {"A": A, "B": B, "C": C, "D": D}
    state = mbs.State.at(
        system,
        {"D": D},
        velocities={"D": _rate_of_D()},
        guess={n: v for n, v in guess.items() if n != cut},
    )
    for ours, theirs in zip(jax.tree.leaves(body_motion(system, state)), jax.tree.leaves(reference), strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-7)


def _rate_of_D(crank_rate=2.0):
    h = 1e-5
    return float((four_bar_angles(0.7 + h)[2] - four_bar_angles(0.7 - h)[2]) / (2 * h)) * crank_rate


def _sprung(law_on_every_joint, at=False):
    """The four-bar with torsion springs on all four pins: on the joints themselves, or as one effort on A, B, D."""
    stiffness = {"A": 1.0, "B": 2.0, "C": 3.0, "D": 4.0}
    angles = four_bar_angles(0.7)
    world = np.cumsum([angles[0], angles[1]]).tolist() + [angles[2]]
    lengths = {"crank": 0.3, "coupler": 0.9, "rocker": 0.7}
    starts = [np.zeros(3), np.array([0.3 * np.cos(world[0]), 0.3 * np.sin(world[0]), 0.0]), np.array([1.0, 0.0, 0.0])]
    tip = starts[2] + 0.7 * np.array([np.cos(world[2]), np.sin(world[2]), 0.0])
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    for (name, length), start, angle in zip(lengths.items(), starts, world, strict=True):
        pose = {"position": start, "rotation": rotation_about((0, 0, 1), angle)} if at else {}
        b.body(name, mass=1.0, com=(length / 2, 0.0, 0.0), inertia=(0.01, 0.1, 0.1), **pose)
    ends = {
        "A": ("ground", "crank"),
        "B": ("crank", "coupler"),
        "D": ("ground", "rocker"),
        "C": ("coupler", "rocker"),
    }
    points = {
        "A": ((0, 0, 0), None),
        "B": ((0.3, 0, 0), None),
        "D": ((1.0, 0, 0), None),
        "C": ((0.9, 0, 0), (0.7, 0, 0)),
    }
    at_points = {"A": starts[0], "B": starts[1], "D": starts[2], "C": tip}
    for name, (parent, child) in ends.items():
        if at:
            b.joint(name, PIN, parent, child, at=at_points[name])
        else:
            near, far = (None if p is None else np.asarray(p, float) for p in points[name])
            b.joint(name, PIN, parent, child, parent_frame=near, child_frame=far)
    # Zero of each coordinate: the frames agree; with `at` in the reference pose, else with the bodies in line.
    free = {"A": angles[0], "B": angles[1], "D": angles[2], "C": angles[2] - angles[0] - angles[1]}
    offset = {n: free[n] if at else 0.0 for n in free}
    if law_on_every_joint:
        for n, k in stiffness.items():
            b.force(f"spring_{n}", mbs.SpringDamper(stiffness=k, free_length=-offset[n]), joint=n)
    else:

        def effort(q, u, t):
            C = q[2] - q[0] - q[1]
            return jnp.stack([-q[0] + 3.0 * C, -2.0 * q[1] + 3.0 * C, -4.0 * q[2] - 3.0 * C])

        b.force("springs", mbs.forces.GeneralisedEffort(effort))
    return b.build()


@pytest.mark.long
@pytest.mark.parametrize("at", [False, True], ids=["frames", "at"])
def test_laws_on_every_joint_of_a_loop_split_a_body(at):
    plain, split = _sprung(False), _sprung(True, at=at)
    assert split.topology.cut_joints == ("C.weld",)
    assert split.topology.mobility == plain.topology.mobility == 1
    A, B, D = four_bar_angles(0.7)
    state = mbs.State.at(plain, A=A, velocities={"A": 2.0}, guess={"B": B, "D": D})
    if at:
        other = mbs.State.at(split, A=0.0, velocities={"A": 2.0})
        np.testing.assert_allclose(other.coordinates, 0.0, atol=1e-9)
    else:
        other = mbs.State.at(split, A=A, velocities={"A": 2.0}, guess={"B": B, "D": D, "C": D - A - B})
        np.testing.assert_allclose(split.coordinates(other)["C"], D - A - B, atol=1e-9)
    found, expected = body_motion(split, other)[0], body_motion(plain, state)[0]
    for name in expected:
        for ours, theirs in zip(found[name], expected[name], strict=True):
            np.testing.assert_allclose(ours, theirs, atol=1e-7)


@pytest.mark.long
def test_a_drive_is_never_cut():
    system = four_bar(drive=lambda t: 0.7 + t, cut=None)
    assert "A" not in system.topology.cut_joints
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    b.body("one", mass=1.0, inertia=np.ones(3))
    b.joint("first", PIN, "ground", "one")
    b.joint("second", PIN, "ground", "one")
    b.drive("second", lambda t: t)
    top = b.build().topology
    assert top.cut_joints == ("first",)


# ------------------------------------------------------------------------------------------------- frames
@pytest.mark.long
def test_at_places_both_frames():
    """A double pendulum declared by world points equals one declared by frames in the bodies."""
    R = rotation_about((0, 0, 1), 0.4)
    by_point, by_frame = mbs.SystemBuilder(gravity=DOWN_Y), mbs.SystemBuilder(gravity=DOWN_Y)
    pose = {"position": (0.2, 0.1, 0.0), "rotation": R}
    tip = np.array([0.2, 0.1, 0.0]) + R @ np.array([1.0, 0.0, 0.0])
    for b in (by_point, by_frame):
        b.body("upper", mass=1.0, com=(0.5, 0.0, 0.0), inertia=(0.01, 0.1, 0.1), **pose)
        b.body("lower", mass=1.0, com=(0.5, 0.0, 0.0), inertia=(0.01, 0.1, 0.1), position=tip)
    by_point.joint("top", PIN, "ground", "upper", at=(0.2, 0.1, 0.0))
    by_point.joint("middle", PIN, "upper", "lower", at=tip)
    by_frame.joint("top", PIN, "ground", "upper", (0.2, 0.1, 0.0), mbs.Pose((0.0, 0.0, 0.0), R.T))
    by_frame.joint("middle", PIN, "upper", "lower", mbs.Pose((1.0, 0.0, 0.0), R.T), None)
    one, two = by_point.build(), by_frame.build()
    state = mbs.State(jnp.zeros(()), jnp.array([0.3, -0.5]), jnp.array([1.0, 2.0]))
    np.testing.assert_allclose(mbs.forward_dynamics(one, state)[0], mbs.forward_dynamics(two, state)[0], atol=1e-12)
    np.testing.assert_allclose(mbs.position(one, state, "lower"), mbs.position(two, state, "lower"), atol=1e-12)
    rest = mbs.State.at(one)
    np.testing.assert_allclose(mbs.rotation(one, rest, "upper"), R, atol=1e-12)
    np.testing.assert_allclose(mbs.position(one, rest, "lower"), tip, atol=1e-12)


@pytest.mark.long
def test_named_frames_serve_everywhere():
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    b.body("arm", mass=1.0, com=(0.5, 0.0, 0.0), inertia=np.ones(3))
    b.frame("eye", on="arm", position=(-0.1, 0.0, 0.0))
    b.frame("tip", on="arm", position=(1.0, 0.0, 0.0), rotation=rotation_about((0, 0, 1), np.pi / 2))
    b.frame("wall", on="ground", position=(0.0, 2.0, 0.0))
    b.joint("pin", PIN, "ground", "arm", parent_frame="wall", child_frame="eye")
    b.force("pull", mbs.Force((0.0, 5.0, 0.0)), on="tip")
    system = b.build()
    state = mbs.State.at(system, pin=0.0)
    np.testing.assert_allclose(mbs.position(system, state, "tip"), [1.1, 2.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(mbs.rotation(system, state, "tip")[:, 0], [0.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(mbs.position(system, state, ("tip", (0.0, 1.0, 0.0))), [0.1, 2.0, 0.0], atol=1e-12)
    inertia = 1.0 + 0.6**2
    acceleration = mbs.forward_dynamics(system, state)[0]
    np.testing.assert_allclose(acceleration, [(5.0 * 1.1 - 9.81 * 0.6) / inertia], rtol=1e-12)


# --------------------------------------------------------------------------------------------------- welds
@pytest.mark.long
def test_a_chain_of_welds_is_one_body():
    """Three welded rods swing as the combined body; the last hangs on a welded plate of the ground."""
    rod = mbs.inertia.rod(1.0, 0.4)
    turn = rotation_about((1, 2, 3), 0.8)
    b = mbs.SystemBuilder()
    b.body("plate", mass=3.0, inertia=np.ones(3))
    b.joint("base", mbs.Weld(), "ground", "plate", parent_frame=(0.0, 0.0, 0.5))
    for k in range(3):
        b.body(f"rod_{k}", mass=1.0, com=(0.2, 0.0, 0.0), inertia=rod)
    b.joint("pin", mbs.Revolute(axis="y"), "plate", "rod_0")
    for k in range(2):
        b.joint(f"weld_{k}", mbs.Weld(), f"rod_{k}", f"rod_{k + 1}", parent_frame=mbs.Pose((0.4, 0.0, 0.0), turn))
    system = b.build()
    assert system.topology.num_velocities == 1
    parts, R, x = [], np.eye(3), np.zeros(3)
    for _ in range(3):
        parts.append((1.0, x + R @ [0.2, 0.0, 0.0], R @ np.asarray(rod) @ R.T))
        x, R = x + R @ [0.4, 0.0, 0.0], R @ turn
    com = np.mean([c for _, c, _ in parts], axis=0)
    inertia = sum(I[1, 1] + c[0] ** 2 + c[2] ** 2 for _, c, I in parts)
    np.testing.assert_allclose(mbs.mass_matrix(system, mbs.State.at(system)), [[inertia]], rtol=1e-12)
    # About +y the weight at x turns it by +m g x (z towards x is positive about y).
    expected = 3.0 * 9.81 * com[0] / inertia
    np.testing.assert_allclose(mbs.forward_dynamics(system, mbs.State.at(system))[0], [expected], rtol=1e-12)


# ------------------------------------------------------------------------------------------ equal topology
@pytest.mark.long
def test_equal_models_share_compiled_code():
    """Other numbers, one topology: of a rebuild with `like`, and of a model with other masses on its own."""
    one = four_bar()
    others = four_bar((1.1, 0.35, 0.8, 0.75), like=one), four_bar(masses=(2.0, 1.0, 3.0))
    count = 0

    @jax.jit
    def traced(system):
        nonlocal count
        count += 1
        return system.mass.sum()

    traced(one)
    for two in others:
        assert one.topology == two.topology and hash(one.topology) == hash(two.topology)
        assert jax.tree.structure(one) == jax.tree.structure(two)
        traced(two)
    assert count == 1
    assert one.topology != four_bar(cut=("B",)).topology


def test_like_takes_over_the_analysis_and_refuses_others():
    one = four_bar()
    assert four_bar((1.1, 0.35, 0.8, 0.75), like=one).topology == one.topology
    with pytest.raises(mbs.ModelError, match="topology differs"):
        four_bar(like=one, cut=("B",))


def test_a_traced_loop_needs_like():
    with pytest.raises(mbs.ModelError, match=r"needs build\(like=system\)"):
        jax.jit(lambda length: four_bar((1.0, length, 0.9, 0.7)).mass)(0.3)


@pytest.mark.long
def test_traced_trees_build_alone():
    def period_squared(length):
        b = mbs.SystemBuilder(gravity=DOWN_Y)
        b.body("bob", mass=2.0, com=jnp.stack([0.0 * length, -length, 0.0 * length]))
        b.joint("pin", PIN, "ground", "bob")
        state = mbs.State(jnp.zeros(()), jnp.array([0.5]), jnp.zeros(1))
        return mbs.forward_dynamics(b.build(), state)[0][0]

    value, slope = jax.jit(jax.value_and_grad(period_squared))(0.8)
    np.testing.assert_allclose(value, -9.81 * np.sin(0.5) / 0.8, rtol=1e-12)
    np.testing.assert_allclose(slope, 9.81 * np.sin(0.5) / 0.8**2, rtol=1e-12)
