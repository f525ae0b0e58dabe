"""Every joint: its pose from the definition of its coordinates, in a tree and as the closure of a loop."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jaxmbs as mbs
from tests import random_systems as rs
from tests.marks import cases
from tests.models import rotation_about

AXIS = np.array([1.0, 2.0, -0.5])
CROSSED = np.array([[1.0, 2.0, 2.0], [2.0, 1.0, -2.0]])
PITCH = 0.08
EXAMPLES = {
    "Revolute": mbs.Revolute(axis=AXIS),
    "Prismatic": mbs.Prismatic(axis=AXIS),
    "Cylindrical": mbs.Cylindrical(axis=AXIS),
    "Screw": mbs.Screw(axis=AXIS, pitch=PITCH),
    "Universal": mbs.Universal(axes=CROSSED),
    "Spherical": mbs.Spherical(),
    "Planar": mbs.Planar(normal="x"),
    "Weld": mbs.Weld(),
    "Free": mbs.Free(),
}
REVERSIBLE = ("Revolute", "Prismatic", "Cylindrical", "Screw", "Weld")
CLOSING = tuple(name for name in EXAMPLES if name != "Free")
UNIT = AXIS / np.linalg.norm(AXIS)


def test_every_joint_has_an_example():
    assert {type(kind) for kind in EXAMPLES.values()} == set(mbs.joints.ALL)


def quaternion(q):
    return Rotation.from_quat(np.roll(q, -1)).as_matrix()


def motion(name, q):
    """(rotation, displacement) of the child frame in the parent frame, as the coordinates are defined."""
    none = np.zeros(3)
    if name == "Revolute":
        return rotation_about(AXIS, q[0]), none
    if name == "Prismatic":
        return np.eye(3), q[0] * UNIT
    if name == "Cylindrical":
        return rotation_about(AXIS, q[1]), q[0] * UNIT
    if name == "Screw":
        return rotation_about(AXIS, q[0]), PITCH * q[0] * UNIT
    if name == "Universal":
        return rotation_about(CROSSED[0], q[0]) @ rotation_about(CROSSED[1], q[1]), none
    if name == "Spherical":
        return quaternion(q), none
    if name == "Planar":
        return rotation_about((1, 0, 0), q[2]), np.array([0.0, q[0], q[1]])
    if name == "Free":
        return quaternion(q[3:]), q[:3]
    return np.eye(3), none


def moved(name, q, u, h):
    """Coordinates a time h later at constant velocities (quaternions by the angular velocity in child axes)."""
    balls = {"Spherical": 0, "Free": 3}
    if name not in balls:
        return q + h * u
    at = balls[name]
    turned = Rotation.from_quat(np.roll(q[at:], -1)) * Rotation.from_rotvec(h * u[at:])
    return np.r_[q[:at] + h * u[:at], np.roll(turned.as_quat(), 1)]


# ------------------------------------------------------------------------------------------------ systems
# Two arms turn on the ground; each kind carries a body on the first.  The screws have the second arm, since MuJoCo
# has none; the free joint stands on the ground.  "_back": the same frames, declared from the body to the arm.
BODIES = tuple(EXAMPLES) + tuple(f"{n}_back" for n in REVERSIBLE)
BACK = tuple(n for n in BODIES if n.endswith("_back"))
FIRST_JOINTS = tuple(f"{n}{back}" for back in ("", "_back") for n in ("Revolute", "Prismatic", "Cylindrical"))
ARMS = ("arm", "arm_of_screws")


def kind_of(body):
    return "Revolute" if body in ARMS else body.removesuffix("_back")


def declared():
    """Body name -> (name of the parent body, link)."""
    names = (*ARMS, *BODIES)
    links = rs.random_links(3, [EXAMPLES[kind_of(n)] for n in names], (-1,) * len(names))
    links[names.index("Free")].parent_frame = (np.eye(3), np.zeros(3))
    on_arm = {n: "arm_of_screws" if kind_of(n) == "Screw" else "arm" for n in BODIES if n != "Free"}
    return {n: (on_arm.get(n, "ground"), link) for n, link in zip(names, links, strict=True)}


LINKS = declared()


def build(names, closing=False, mirrored=False):
    """The system of the arms and these bodies.

    `closing`: they float on free joints and their own joints close loops; `mirrored`: no joint is backwards.
    """
    names = (*ARMS, *names)
    b = mbs.SystemBuilder(gravity=rs.GRAVITY)
    for name in names:
        link = LINKS[name][1]
        b.body(name, mass=link.mass, com=link.com, inertia=link.inertia)
    for name in names if closing else ():
        if name not in ARMS:
            b.joint(f"{name}_floats", mbs.Free(), "ground", name)
    for name in names:
        parent, link = LINKS[name]
        near, far = rs.as_pose(link.parent_frame), rs.as_pose(link.child_frame)
        if name.endswith("_back") and not mirrored:
            b.joint(f"{name}_joint", link.kind, name, parent, parent_frame=far, child_frame=near)
        else:
            b.joint(f"{name}_joint", link.kind, parent, name, parent_frame=near, child_frame=far)
    return b.build()


def pose_of(body, coordinates):
    """World pose of a body from the coordinates of its own joint and its arm's, by the definitions alone."""
    if body == "ground":
        return np.eye(3), np.zeros(3)
    parent, link = LINKS[body]
    relative = motion(kind_of(body), coordinates[body])
    relative = rs.back(relative) if body.endswith("_back") else relative
    start = rs.after(pose_of(parent, coordinates), link.parent_frame)
    return rs.after(rs.after(start, relative), rs.back(link.child_frame))


@jax.jit
def look(system, state):
    """Pose and velocity of every body."""
    functions = (mbs.rotation, mbs.position, mbs.kinematics.angular_velocity, mbs.velocity)
    return {n: tuple(f(system, state, n) for f in functions) for n in system.topology.body_names}


@jax.jit
def outcome(system, state):
    """Accelerations of the velocities, and the reactions (force, moment) of every joint."""
    loads = mbs.reactions(system, state)
    return mbs.forward_dynamics(system, state)[0], {n: (load.force, load.moment) for n, load in loads.items()}


@jax.jit
def on_parents(system, state):
    """Reactions (force, moment) of every joint on its parent."""
    return {n: (load.force, load.moment) for n, load in mbs.reactions(system, state, side="parent").items()}


def by_body(system, values, part, end="_joint"):
    """Numbers of each body's own joint."""
    named = {j.name.removesuffix(end): j for j in system.topology.joints if j.name.endswith(end)}
    return {n: np.asarray(values)[getattr(j, part)] for n, j in named.items()}


@pytest.fixture(scope="module")
def tree():
    system = build(tuple(EXAMPLES))
    return system, rs.random_state(system, 5)


@pytest.fixture(scope="module")
def back():
    system = build(BACK)
    return system, rs.random_state(system, 6)


@pytest.fixture(scope="module")
def mirror(back):
    """The bodies of `back` in the same state, declared from arm to body: coordinates change sign."""
    system, sign = build(BACK, mirrored=True), np.where(np.arange(back[0].topology.num_velocities) < 0, 1.0, -1.0)
    assert system.topology.body_names == back[0].topology.body_names
    for joint in system.topology.joints:
        if joint.name in ("arm_joint", "arm_of_screws_joint"):
            sign[joint.velocities] = 1.0
    state = back[1]
    return system, mbs.State(state.t, state.coordinates * sign, state.velocities * sign), sign


@pytest.fixture(scope="module")
def loops(tree):
    """The same bodies in the same state, carried by free joints and held by the cut ones."""
    system, seen = build(CLOSING, closing=True), look(*tree)
    psi, u = (np.zeros(n) for n in (system.topology.num_coordinates, system.topology.num_velocities))
    own = [
        by_body(*(tree[0], x, part))
        for x, part in ((tree[1].coordinates, "coordinates"), (tree[1].velocities, "velocities"))
    ]
    for joint in system.topology.joints:
        if joint.name in ("arm_joint", "arm_of_screws_joint"):
            name = joint.name.removesuffix("_joint")
            psi[joint.coordinates], u[joint.velocities] = own[0][name], own[1][name]
        elif not joint.is_cut:
            R, x, w, v = (np.asarray(part) for part in seen[joint.name.removesuffix("_floats")])
            psi[joint.coordinates] = np.r_[x, np.roll(Rotation.from_matrix(R).as_quat(), 1)]
            u[joint.velocities] = np.r_[v, R.T @ w]
    return system, mbs.State(jnp.zeros(()), jnp.asarray(psi), jnp.asarray(u))


# -------------------------------------------------------------------------------------------------- tests
@pytest.mark.long
@pytest.mark.parametrize("name", BODIES)
def test_pose_follows_the_definition(name, tree, back):
    tree = back if name in BACK else tree
    R, x = pose_of(name, by_body(tree[0], tree[1].coordinates, "coordinates"))
    seen = look(*tree)[name]
    np.testing.assert_allclose(seen[0], R, atol=1e-12)
    np.testing.assert_allclose(seen[1], x, atol=1e-12)


@pytest.mark.parametrize("name", cases(BODIES, long=FIRST_JOINTS))
def test_velocity_is_the_rate_of_the_pose(name, tree, back):
    system, state = back if name in BACK else tree
    psi, u = by_body(system, state.coordinates, "coordinates"), by_body(system, state.velocities, "velocities")

    def at(h):
        return pose_of(name, {n: moved(kind_of(n), psi[n], u[n], h) for n in (*ARMS, name)})

    h = 1e-5
    (R_1, x_1), (R_0, x_0), (R, _) = at(h), at(-h), at(0.0)
    spin = (R_1 - R_0) / (2 * h) @ R.T
    _, _, w, v = look(system, state)[name]
    np.testing.assert_allclose(w, [spin[2, 1], spin[0, 2], spin[1, 0]], atol=1e-8)
    np.testing.assert_allclose(v, (x_1 - x_0) / (2 * h), atol=1e-8)


@pytest.mark.parametrize("name", CLOSING)
def test_rows_vanish_on_the_joint_and_nowhere_else(name):
    kind, random = EXAMPLES[name], np.random.default_rng(2)
    size = {"Spherical": 4}.get(name, len(kind.nodes))
    basis = np.asarray(kind.basis())
    rows = jax.jit(lambda R, d: kind.closure(basis.T @ R @ basis, basis.T @ d))

    def twisted(R, d, twist):
        return rows(rotation_about(twist[:3], np.linalg.norm(twist[:3])) @ R, d + twist[3:])

    for _ in range(5):
        q = 0.7 * random.normal(size=size)
        q = q / np.linalg.norm(q) if name == "Spherical" else q
        R, d = motion(name, q)
        assert rows(R, d).shape == (kind.num_rows,)
        np.testing.assert_allclose(rows(R, d), 0.0, atol=1e-12)
        h = 1e-6
        steps = h * np.c_[np.eye(6), np.eye(6)].T * np.repeat([1.0, -1.0], 6)[:, None]
        tiny = np.array([0.0, 0.0, 1e-30, 0.0, 0.0, 0.0])
        f = np.array([twisted(R, d, s + tiny) for s in steps])
        J = (f[:6] - f[6:]).T / (2 * h)
        assert np.linalg.matrix_rank(J, tol=1e-6) == kind.num_rows


@pytest.mark.parametrize("name, turn", [("Revolute", (1, 0, 0)), ("Prismatic", (0, 0, 1)), ("Screw", (0, 0, 1))])
def test_half_a_turn_off_is_not_closed(name, turn):
    """In canonical axes: rows by half angles, unlike sines, see the opposite pose as open."""
    unit = EXAMPLES[name].pitch if name == "Screw" else 1.0
    for angle in (np.pi, np.pi - 0.1):
        rows = EXAMPLES[name].closure(jnp.asarray(rotation_about(turn, angle)), jnp.zeros(3))
        assert np.max(np.abs(rows)) > 3.9 * unit


def test_a_free_joint_closes_nothing():
    with pytest.raises(NotImplementedError, match="Free joint leaves all motions free"):
        mbs.Free().closure(jnp.eye(3), jnp.zeros(3))


@pytest.fixture(scope="module")
def tree_outcome(tree):
    return outcome(*tree)


@pytest.fixture(scope="module")
def mujoco_accelerations(tree):
    """Accelerations by body for all but the screw; its arm moves alone."""
    names = ["arm"] + [n for n in EXAMPLES if n != "Screw"]
    links = [dataclasses.replace(LINKS[n][1], parent=0 if LINKS[n][0] == "arm" else -1) for n in names]
    psi, u = (by_body(tree[0], getattr(tree[1], part), part) for part in ("coordinates", "velocities"))
    state = mbs.State(
        *(
            jnp.asarray(x)
            for x in (0.0, np.concatenate([psi[n] for n in names]), np.concatenate([u[n] for n in names]))
        )
    )
    accelerations = rs.mujoco_data(rs.mujoco_model(links), state).qacc
    ends = np.cumsum([0] + [len(u[n]) for n in names])
    return {n: accelerations[i:j] for n, i, j in zip(names, ends, ends[1:], strict=False)}


@pytest.mark.parametrize(
    "name",
    cases(["arm", *(n for n in EXAMPLES if n not in ("Screw", "Weld"))], long=["arm", "Revolute", "Prismatic"]),
)
def test_accelerations_are_those_of_mujoco(name, tree, tree_outcome, mujoco_accelerations):
    ours = by_body(tree[0], tree_outcome[0], "velocities")[name]
    np.testing.assert_allclose(ours, mujoco_accelerations[name], rtol=1e-9, atol=1e-9)


@pytest.mark.long
def test_joints_walked_backwards_mirror_those_walked_forwards(back, mirror):
    """Accelerations change sign; the reaction on the child is that on the parent of the mirror."""
    accelerations, loads = outcome(*back)
    expected = mbs.forward_dynamics(*mirror[:2])[0]
    np.testing.assert_allclose(accelerations, np.asarray(expected) * mirror[2], atol=1e-9)
    parents = on_parents(*mirror[:2])
    for name in BACK:
        for ours, theirs in zip(loads[f"{name}_joint"], parents[f"{name}_joint"], strict=True):
            np.testing.assert_allclose(ours, theirs, atol=1e-9)


@pytest.fixture(scope="module")
def loop_outcome(loops):
    return outcome(*loops)


def needed(system, state, name, accelerations):
    """Force, and moment about the joint's origin on the body, that the motion of a floating body takes."""
    link = LINKS[name][1]
    joint = system.topology.joints[system.topology.joint_index[f"{name}_floats"]]
    a, q = np.asarray(accelerations)[joint.velocities], np.asarray(state.coordinates)[joint.coordinates]
    R = quaternion(q[3:])
    w, alpha = R @ np.asarray(state.velocities)[joint.velocities][3:], R @ a[3:]
    r, inertia = R @ link.com, R @ link.inertia @ R.T
    force = link.mass * (a[:3] + np.cross(alpha, r) + np.cross(w, np.cross(w, r)) - np.array(rs.GRAVITY))
    arm = r - R @ link.child_frame[1]
    return force, inertia @ alpha + np.cross(w, inertia @ w) + np.cross(arm, force)


@pytest.mark.long
@pytest.mark.parametrize("name", CLOSING)
def test_closing_a_loop_equals_carrying_the_body(name, loops, loop_outcome, tree_outcome):
    """The cut joint's reaction, the tree joint's, and what the body's own motion needs are one."""
    accelerations, loads = loop_outcome
    need, carried = needed(*loops, name, accelerations), tree_outcome[1][f"{name}_joint"]
    for cut, tree, motion in zip(loads[f"{name}_joint"], carried, need, strict=True):
        np.testing.assert_allclose(cut, motion, atol=1e-7)
        np.testing.assert_allclose(cut, tree, atol=1e-7)


@pytest.mark.long
def test_the_arms_feel_the_loops_as_they_feel_the_tree(tree, tree_outcome, loops, loop_outcome):
    for arm in ARMS:
        ours = by_body(loops[0], loop_outcome[0], "velocities")[arm]
        np.testing.assert_allclose(ours, by_body(tree[0], tree_outcome[0], "velocities")[arm], atol=1e-8)


@pytest.mark.long
def test_the_cut_joints_are_counted(loops):
    top = loops[0].topology
    assert set(top.cut_joints) == {f"{n}_joint" for n in CLOSING}
    assert top.num_rows == sum(EXAMPLES[n].num_rows for n in CLOSING)
    freedoms = {
        "Revolute": 1,
        "Prismatic": 1,
        "Cylindrical": 2,
        "Screw": 1,
        "Universal": 2,
        "Spherical": 3,
        "Planar": 3,
    }
    assert top.mobility == 2 + sum(freedoms.values())
    assert top.analysis.redundant == 0


def finite(tangents):
    leaves = [np.asarray(leaf) for leaf in jax.tree.leaves(tangents) if np.asarray(leaf).dtype == float]
    assert all(np.all(np.isfinite(leaf)) for leaf in leaves)
    return max(np.max(np.abs(leaf), initial=0.0) for leaf in leaves)


@pytest.mark.long
def test_derivatives_are_finite_at_zero(tree):
    """Reverse mode with respect to everything: coordinates zero, quaternions one, at rest."""
    system, _ = tree
    psi = np.zeros(system.topology.num_coordinates)
    psi[np.asarray(system.topology.node_coordinate)[system.topology.balls]] = 1.0
    state = mbs.State(jnp.zeros(()), jnp.asarray(psi), jnp.zeros(system.topology.num_velocities))
    gradient = jax.jit(jax.grad(lambda both: jnp.sum(mbs.forward_dynamics(*both)[0])))((system, state))
    assert finite(gradient) > 1.0


@pytest.mark.long
def test_derivatives_of_closed_loops_are_finite_at_rest(loops):
    """Forward mode along a step of every number of the model and the state."""
    system, state = loops
    state = mbs.State(state.t, state.coordinates, jnp.zeros_like(state.velocities))
    ones = jax.tree.map(jnp.ones_like, (system, state))
    tangent = jax.jit(lambda p, v: jax.jvp(lambda both: mbs.forward_dynamics(*both), (p,), (v,))[1])
    assert finite(tangent((system, state), ones)) > 1.0
