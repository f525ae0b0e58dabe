"""Every joint: its pose from the definition of its coordinates, in a tree and as the closure of a loop."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import random_systems as rs
from mechanisms import rotation_about
from scipy.spatial.transform import Rotation

import jaxmbs as mbs

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
def links_of(names):
    """An arm turning on the ground, and one body on it for each kind; the free one stands on the ground."""
    links = rs.random_links(3, [mbs.Revolute(axis=AXIS)] + [EXAMPLES[n] for n in names], (-1,) + (0,) * len(names))
    for link, name in zip(links[1:], names, strict=True):
        if name == "Free":
            link.parent, link.parent_frame = -1, (np.eye(3), np.zeros(3))
    return links


def declare(names, backwards=False, closing=False):
    """The system; `closing`: every body floats on a free joint and its own joint closes a loop."""
    links = links_of(names)
    b = mbs.SystemBuilder(gravity=rs.GRAVITY)
    ends = {"arm": links[0]} | dict(zip(names, links[1:], strict=True))
    for name, link in ends.items():
        b.body(name, mass=link.mass, com=link.com, inertia=link.inertia)
        if closing and name != "arm":
            b.joint(f"{name}_floats", mbs.Free(), "ground", name)
    for name, link in ends.items():
        parent = "ground" if link.parent < 0 else "arm"
        near, far = rs.as_pose(link.parent_frame), rs.as_pose(link.child_frame)
        if backwards and name != "arm":
            b.joint(f"{name}_joint", link.kind, name, parent, parent_frame=far, child_frame=near)
        else:
            b.joint(f"{name}_joint", link.kind, parent, name, parent_frame=near, child_frame=far)
    return b.build()


def pose_of(names, name, coordinates, backwards):
    """World pose of a body, by the definitions alone."""
    links = links_of(names)
    arm = rs.after(
        rs.after(links[0].parent_frame, motion("Revolute", coordinates["arm"])), rs.back(links[0].child_frame)
    )
    if name == "arm":
        return arm
    link = links[1 + names.index(name)]
    relative = motion(name, coordinates[name])
    relative = rs.back(relative) if backwards else relative
    start = arm if link.parent == 0 else (np.eye(3), np.zeros(3))
    return rs.after(rs.after(rs.after(start, link.parent_frame), relative), rs.back(link.child_frame))


@jax.jit
def look(system, state):
    """Pose and velocity of every body."""
    bodies = system.topology.body_names
    return {
        n: (
            mbs.rotation(system, state, n),
            mbs.position(system, state, n),
            mbs.angular_velocity(system, state, n),
            mbs.velocity(system, state, n),
        )
        for n in bodies
    }


@jax.jit
def outcome(system, state):
    """Accelerations of every body and reactions of every joint."""
    a = mbs.forward_dynamics(system, state)[0]
    bodies = system.topology.body_names
    linear = {n: mbs.acceleration(system, state, n, a) for n in bodies}
    angular = {n: mbs.angular_acceleration(system, state, n, a) for n in bodies}
    loads = mbs.reactions(system, state)
    return a, linear, angular, {n: (load.force, load.moment) for n, load in loads.items()}


def by_body(system, values, part):
    """Numbers of each body's own joint."""
    named = {j.name.removesuffix("_joint"): j for j in system.topology.joints}
    return {n: np.asarray(values)[getattr(j, part)] for n, j in named.items()}


@pytest.fixture(scope="module")
def forward():
    system = declare(tuple(EXAMPLES))
    return system, rs.random_state(system, 5)


@pytest.fixture(scope="module")
def backward():
    system = declare(REVERSIBLE, backwards=True)
    return system, rs.random_state(system, 6)


@pytest.fixture(scope="module")
def floating(forward):
    """The bodies of `forward` in the same state, held by the cut joints only."""
    system = declare(CLOSING, closing=True)
    seen = look(*forward)
    tree, state = forward
    psi = by_body(tree, state.coordinates, "coordinates")
    u = by_body(tree, state.velocities, "velocities")
    values, rates = {"arm_joint": psi["arm"]}, {"arm_joint": u["arm"]}
    for name in CLOSING:
        R, x, w, v = (np.asarray(part) for part in seen[name])
        values[f"{name}_floats"] = np.r_[x, np.roll(Rotation.from_matrix(R).as_quat(), 1)]
        rates[f"{name}_floats"] = np.r_[v, R.T @ w]
    state = mbs.State.at(system, {}, guess=values, rates=rates)
    return system, state


# -------------------------------------------------------------------------------------------------- tests
CASES = [(n, False) for n in EXAMPLES] + [(n, True) for n in REVERSIBLE]


def case(forward, backward, reverse):
    return (REVERSIBLE, *backward) if reverse else (tuple(EXAMPLES), *forward)


@pytest.mark.parametrize("name, reverse", CASES)
def test_pose_follows_the_definition(name, reverse, forward, backward):
    names, system, state = case(forward, backward, reverse)
    R, x = pose_of(names, name, by_body(system, state.coordinates, "coordinates"), reverse)
    seen = look(system, state)[name]
    np.testing.assert_allclose(seen[0], R, atol=1e-12)
    np.testing.assert_allclose(seen[1], x, atol=1e-12)


@pytest.mark.parametrize("name, reverse", CASES)
def test_velocity_is_the_rate_of_the_pose(name, reverse, forward, backward):
    names, system, state = case(forward, backward, reverse)
    psi = by_body(system, state.coordinates, "coordinates")
    u = by_body(system, state.velocities, "velocities")

    def at(h):
        later = {n: moved("Revolute" if n == "arm" else n, psi[n], u[n], h) for n in ("arm", name)}
        return pose_of(names, name, later, reverse)

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


def test_a_free_joint_closes_nothing():
    with pytest.raises(NotImplementedError, match="Free joint leaves all motions free"):
        mbs.Free().closure(jnp.eye(3), jnp.zeros(3))


@pytest.mark.parametrize("name", [n for n in EXAMPLES if n not in ("Screw", "Weld")])
def test_accelerations_are_those_of_mujoco(name, forward_and_mujoco):
    ours, theirs = forward_and_mujoco
    np.testing.assert_allclose(ours[name], theirs[name], rtol=1e-10, atol=1e-10)


@pytest.fixture(scope="module")
def forward_and_mujoco():
    """Accelerations by body, ours and MuJoCo's; the screw, which MuJoCo lacks, is left out."""
    names = tuple(n for n in EXAMPLES if n not in ("Screw", "Weld"))
    system = declare(names)
    state = rs.random_state(system, 8)
    theirs = rs.mujoco_data(rs.mujoco_model(links_of(names)), state).qacc
    ours = mbs.forward_dynamics(system, state)[0]
    return by_body(system, ours, "velocities"), by_body(system, theirs, "velocities")


@pytest.mark.parametrize("name", REVERSIBLE)
def test_a_joint_walked_backwards_moves_alike(name, backward):
    """The body that carries the frames of the reversed joint obeys Newton and Euler with the reaction it gets."""
    system, state = backward
    R, x, w, _ = (np.asarray(part) for part in look(system, state)[name])
    _, linear, angular, loads = outcome(system, state)
    link = links_of(REVERSIBLE)[1 + REVERSIBLE.index(name)]
    r, alpha = R @ link.com, np.asarray(angular[name])
    a = np.asarray(linear[name]) + np.cross(alpha, r) + np.cross(w, np.cross(w, r))
    inertia = R @ link.inertia @ R.T
    # The arm is the child of the reversed joint, so the body gets the opposite of the reaction on the child.
    force, moment = (-np.asarray(part) for part in loads[f"{name}_joint"])
    origin = np.asarray(mbs.position(system, state, f"{name}_joint.child"))
    np.testing.assert_allclose(force, link.mass * (a - np.array(rs.GRAVITY)), atol=1e-9)
    about_com = moment + np.cross(origin - x - r, force)
    np.testing.assert_allclose(about_com, inertia @ alpha + np.cross(w, inertia @ w), atol=1e-9)
    # A joint does no work on its own freedoms: the wrench is orthogonal to the relative twist.
    arm = look(system, state)["arm"]
    arm_speed = np.asarray(arm[3]) + np.cross(arm[2], origin - np.asarray(arm[1]))
    own_speed = np.asarray(look(system, state)[name][3]) + np.cross(w, origin - x)
    assert abs(force @ (own_speed - arm_speed) + moment @ (w - np.asarray(arm[2]))) < 1e-9


@pytest.mark.parametrize("name", CLOSING)
def test_closing_a_loop_equals_carrying_the_body(name, outcomes):
    (_, linear, angular, loads), (_, linear_2, angular_2, loads_2) = outcomes
    np.testing.assert_allclose(linear_2[name], linear[name], atol=1e-8)
    np.testing.assert_allclose(angular_2[name], angular[name], atol=1e-8)
    for ours, tree in zip(loads_2[f"{name}_joint"], loads[f"{name}_joint"], strict=True):
        np.testing.assert_allclose(ours, tree, atol=1e-7)


@pytest.fixture(scope="module")
def outcomes(forward, floating):
    return outcome(*forward), outcome(*floating)


def test_the_cut_joints_are_counted(floating):
    top = floating[0].topology
    assert set(top.cut_joints) == {f"{n}_joint" for n in CLOSING}
    assert top.num_rows == sum(EXAMPLES[n].num_rows for n in CLOSING)
    freedoms = {"Revolute": 1, "Prismatic": 1, "Cylindrical": 2, "Screw": 1, "Universal": 2, "Spherical": 3, "Planar": 3}
    assert top.mobility == 1 + sum(freedoms.values())
    assert top.analysis.redundant == 0


@pytest.mark.parametrize("which", ["forward", "floating"])
def test_derivatives_are_finite_at_zero(which, request):
    """All coordinates zero, quaternions one, at rest."""
    system, state = request.getfixturevalue(which)
    if which == "forward":
        psi = np.zeros(system.topology.num_coordinates)
        psi[np.asarray(system.topology.node_coordinate)[system.topology.balls]] = 1.0
    else:
        psi = np.asarray(state.coordinates)  # neutral poses do not close the loops
    state = mbs.State(jnp.zeros(()), jnp.asarray(psi), jnp.zeros(system.topology.num_velocities))
    gradient = jax.jit(
        jax.grad(lambda both: jnp.sum(mbs.forward_dynamics(*both)[0]), allow_int=True)
    )((system, state))
    leaves = [np.asarray(leaf) for leaf in jax.tree.leaves(gradient)]
    assert all(np.all(np.isfinite(leaf)) for leaf in leaves)
    assert max(np.max(np.abs(leaf), initial=0.0) for leaf in leaves) > 1.0
