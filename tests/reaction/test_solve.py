"""Reactions: closed forms, equilibrium of every body, sides and axes, redundant loads, Pinocchio's joint forces."""

import jax
import jax.numpy as jnp
import numpy as np
import pinocchio as pin
import pytest

import jaxmbs as mbs
from tests import random_systems as rs
from tests.models import DOWN_Y, PIN, four_bar, four_bar_angles, rotation_about


def both(loads, name):
    return np.asarray(loads[name].force), np.asarray(loads[name].moment)


# --------------------------------------------------------------------------------------------- closed forms
@pytest.fixture(scope="module")
def pendulum():
    """Uniform rod of 2 kg, 1.2 m that swings about z; the joint frame is turned on the child by a right angle."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    b.body("rod", mass=2.0, com=(0.0, -0.6, 0.1), inertia=(0.24, 0.01, 0.24))
    turn = mbs.Pose((0.0, 0.0, 0.0), rotation_about((0, 0, 1), np.pi / 2))
    b.joint("pin", PIN, "ground", "rod", parent_frame=turn, child_frame=turn)
    b.force("spring", mbs.SpringDamper(stiffness=3.0), joint="pin")
    system = b.build()
    return system, mbs.State.at(system, pin=0.4, velocities={"pin": 1.5})


def test_pendulum_in_closed_form(pendulum):
    system, state = pendulum
    loads = mbs.reactions(system, state)
    q, w = 0.4, 1.5
    inertia = 0.24 + 2.0 * 0.36
    alpha = (-2.0 * 9.81 * 0.6 * np.sin(q) - 3.0 * q) / inertia
    radial, tangential = np.array([np.sin(q), -np.cos(q), 0.0]), np.array([np.cos(q), np.sin(q), 0.0])
    force = 2.0 * (0.6 * alpha * tangential - 0.6 * w**2 * radial + [0.0, 9.81, 0.0])
    np.testing.assert_allclose(both(loads, "pin")[0], force, atol=1e-12)
    # The centre of mass stands 0.1 m out of the plane: the pin's moment in the plane turns force into place,
    # with no products of inertia about the centre of mass.
    moment = np.cross([0.0, 0.0, 0.1], force) + np.array([0.0, 0.0, -3.0 * q])
    np.testing.assert_allclose(both(loads, "pin")[1], moment, atol=1e-12)
    np.testing.assert_allclose(loads["pin"].effort, [-3.0 * q], atol=1e-12)
    assert loads["pin"].unique_force.all() and loads["pin"].unique_moment.all()


@pytest.mark.long
def test_sides_are_opposite_and_axes_are_turned(pendulum):
    system, state = pendulum
    child, parent = mbs.reactions(system, state), mbs.reactions(system, state, side="parent")
    for ours, theirs in zip(both(child, "pin"), both(parent, "pin"), strict=True):
        np.testing.assert_allclose(ours, -theirs, atol=1e-13)
    local = mbs.reactions(system, state, frame="joint")
    R = rotation_about((0, 0, 1), 0.4 + np.pi / 2)
    for world, turned in zip(both(child, "pin"), both(local, "pin"), strict=True):
        np.testing.assert_allclose(R.T @ world, turned, atol=1e-12)
    on_parent = mbs.reactions(system, state, frame="joint", side="parent")
    R = rotation_about((0, 0, 1), np.pi / 2)
    np.testing.assert_allclose(-R.T @ both(child, "pin")[0], both(on_parent, "pin")[0], atol=1e-12)


@pytest.mark.parametrize("option", [{"frame": "body"}, {"side": "left"}])
def test_unknown_frame_or_side(pendulum, option):
    with pytest.raises(ValueError, match="frame must be 'world' or 'joint' and side 'child' or 'parent'"):
        mbs.reactions(*pendulum, **option)


@pytest.mark.long
def test_moment_is_about_the_origin_on_that_side():
    """A slider loaded across its guide: on the parent's side the moment refers to the guide's own origin."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("slider", mass=1.0, inertia=np.ones(3))
    b.joint("guide", mbs.Prismatic(axis="x"), "ground", "slider")
    b.force("push", mbs.Force((0.0, 7.0, 0.0)), on="slider")
    system = b.build()
    state = mbs.State.at(system, guide=0.5)
    child, parent = mbs.reactions(system, state), mbs.reactions(system, state, side="parent")
    np.testing.assert_allclose(both(child, "guide"), [[0.0, -7.0, 0.0], [0.0, 0.0, 0.0]], atol=1e-13)
    np.testing.assert_allclose(both(parent, "guide"), [[0.0, 7.0, 0.0], [0.0, 0.0, 3.5]], atol=1e-13)


def cantilever(drive):
    """Three welded rods of 1 kg, 0.5 m along x with an end load; on a driven or a welded root."""
    b = mbs.SystemBuilder()
    for k in range(3):
        b.body(f"rod_{k}", mass=1.0, com=(0.25, 0.0, 0.0), inertia=(0.0, 1 / 48, 1 / 48))
    b.joint("root", mbs.Revolute(axis="y") if drive else mbs.Weld(), "ground", "rod_0", drive=drive)
    for k in range(2):
        b.joint(f"weld_{k}", mbs.Weld(), f"rod_{k}", f"rod_{k + 1}", parent_frame=(0.5, 0.0, 0.0))
    b.force("end", mbs.Force((0.0, 4.0, -2.0)), on=("rod_2", (0.5, 0.0, 0.0)))
    return b.build()


@pytest.mark.parametrize(
    "drive", [None, pytest.param(lambda t: 0.0 * t, marks=pytest.mark.long)], ids=["welded", "driven"]
)
def test_static_cantilever(drive):
    system = cantilever(drive)
    loads = mbs.reactions(system, mbs.State.at(system))
    for k, name in enumerate(("root", "weld_0", "weld_1")):
        rods, arm = 3 - k, 1.5 - 0.5 * k
        force = np.array([0.0, -4.0, 2.0 + 9.81 * rods])
        # Moments of the loads about the joint: x cross F, with the weight in the middle.
        outer = np.cross([arm, 0.0, 0.0], [0.0, 4.0, -2.0]) + np.cross([arm / 2, 0.0, 0.0], [0.0, 0.0, -9.81 * rods])
        np.testing.assert_allclose(both(loads, name)[0], force, atol=1e-10)
        np.testing.assert_allclose(both(loads, name)[1], -outer, atol=1e-10)
    if drive is not None:
        weights = 1.5 * 2.0 + 0.75 * 3 * 9.81
        np.testing.assert_allclose(loads["root"].effort, [-weights], atol=1e-10)


# ------------------------------------------------------------------------------------------ redundant loads
@pytest.mark.long
def test_two_pins_share_what_statics_cannot_tell():
    """A beam on two pins: the weight by levers, the pull along the beam in halves."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    b.body("beam", mass=3.0, com=(0.4, 0.0, 0.0), inertia=(0.01, 0.3, 0.3))
    b.joint("left", PIN, "ground", "beam")
    b.joint("right", PIN, "ground", "beam", parent_frame=(2.0, 0.0, 0.0), child_frame=(2.0, 0.0, 0.0))
    b.force("pull", mbs.Force((10.0, 0.0, 0.0)), on="beam")
    system = b.build()
    assert system.topology.mobility == 0
    loads = mbs.reactions(system, mbs.State.at(system))
    np.testing.assert_allclose(loads["left"].force, [-5.0, 3 * 9.81 * 0.8, 0.0], atol=1e-8)
    np.testing.assert_allclose(loads["right"].force, [-5.0, 3 * 9.81 * 0.2, 0.0], atol=1e-8)
    for name in ("left", "right"):
        np.testing.assert_allclose(loads[name].moment, 0.0, atol=1e-8)
        np.testing.assert_array_equal(loads[name].unique_force, [False, True, False])


@pytest.mark.long
@pytest.mark.parametrize("right", ["pin", "rod"])
def test_compliant_joints_take_less(right):
    """A bar between two bearings: the pull along it is shared as 1 : 3 where one is three times as soft.

    With a rod at the right the softer bearing is a two-frame constraint.
    """
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("bar", mass=3.0, com=(0.4, 0.0, 0.0), inertia=(0.01, 0.3, 0.3))
    b.joint("left", PIN, "ground", "bar")
    if right == "pin":
        b.joint("right", PIN, "ground", "bar", parent_frame=(2.0, 0.0, 0.0), child_frame=(2.0, 0.0, 0.0))
    else:
        b.constraint(
            "right", mbs.joints.Distance(1.0), between=(("ground", (3.0, 0.0, 0.0)), ("bar", (2.0, 0.0, 0.0)))
        )
        b.constraint("up", mbs.joints.Distance(1.0), between=(("ground", (2.0, 1.0, 0.0)), ("bar", (2.0, 0.0, 0.0))))
    b.force("pull", mbs.Force((10.0, 0.0, 0.0)), on="bar")
    system = b.build()
    soft = {"left": np.r_[np.full(3, 1e-6), np.full(3, 1e-6)], "right": np.r_[np.full(3, 3e-6), np.full(3, 1e-6)]}
    loads = mbs.reactions(system, mbs.State.at(system), compliance=soft)
    np.testing.assert_allclose(loads["left"].force, [-7.5, 0.0, 0.0], atol=1e-8)
    np.testing.assert_allclose(loads["right"].force, [-2.5, 0.0, 0.0], atol=1e-8)
    assert loads.residual < 1e-10
    with pytest.raises(ValueError, match="compliance: there is no joint or constraint 'middle'"):
        mbs.reactions(system, mbs.State.at(system), compliance={"middle": np.ones(6)})


@pytest.mark.long
def test_redundant_drives_share_the_torque():
    """Two motors on one shaft, one declared from the shaft to the ground: the halves have opposite signs."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    b.body("shaft", mass=2.0, com=(0.3, 0.0, 0.5), inertia=(0.02, 0.02, 0.01))
    b.joint("front", PIN, "shaft", "ground", drive=lambda t: 0.0 * t)
    b.joint("back", PIN, "ground", "shaft", (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), drive=lambda t: 0.0 * t)
    b.force("motor", mbs.Torque((0.0, 0.0, 1.0)), on="shaft")
    system = b.build()
    loads = mbs.reactions(system, mbs.State.at(system))
    half = (2.0 * 9.81 * 0.3 - 1.0) / 2.0
    found = [(loads[name].moment[2], loads[name].effort[0]) for name in ("front", "back")]
    np.testing.assert_allclose(found, [(-half, -half), (half, half)], rtol=1e-9)
    assert loads.residual < 1e-9


@pytest.mark.long
def test_the_bonds_of_a_system_have_its_reactions():
    """A four-bar with a spring in a pin, in motion: 18 equations of rank 17, three reactions open, one freedom."""
    system = four_bar(stiffness=3.0, load=5.0)
    _, B, D = four_bar_angles(0.7)
    state = mbs.State.at(system, A=0.7, velocities={"A": 2.0}, guess={"B": B, "D": D})
    loads = mbs.reactions(system, state, frame="joint")
    bonds, needed = mbs.reaction.reaction_bonds(system, state)
    found = mbs.statics.bond_reactions(bonds, needed)
    for name, load in loads.items():
        np.testing.assert_allclose(found[name].force, load.force, atol=1e-8)
        np.testing.assert_allclose(found[name].moment, load.moment, atol=1e-8)
        np.testing.assert_array_equal(found[name].unique_force, load.unique_force)
    matrix = mbs.statics.reaction_matrix(bonds).matrix
    assert matrix.shape == (18, 20) and np.linalg.matrix_rank(matrix, tol=1e-9) == 17
    count = mbs.statics.redundancy(bonds)
    assert (count.redundant, count.mobility) == (system.topology.analysis.redundant, 1)
    family = mbs.statics.reaction_family(bonds, needed)
    np.testing.assert_allclose(family.wrench(found.parameters), found.wrench, atol=1e-10)


FEET = np.array([[1.0, 0.5], [1.0, -0.5], [-1.0, 0.5], [-1.0, -0.5]])


def table(point, support):
    """A table of 10 kg on four feet; `point` (x, y) of its centre of mass."""
    b = mbs.SystemBuilder()
    b.body("table", mass=10.0, com=(*point, 0.3), inertia=np.ones(3))
    if support == "plane":
        b.joint("floats", mbs.Free(), "ground", "table")
    for k, (x, y) in enumerate(FEET):
        foot = (x, y, 0.0)
        if support == "plane":
            b.constraint(f"foot_{k}", mbs.joints.PointOnPlane(), between=("ground", ("table", foot)))
        else:
            b.joint(f"foot_{k}", mbs.Spherical(), "ground", "table", parent_frame=foot, child_frame=foot)
    return b.build()


@pytest.mark.long
@pytest.mark.parametrize("support, redundant, marks", [("plane", 1, (1, 1, 0)), ("ball", 6, (0, 0, 0))])
def test_a_table_on_four_legs_takes_the_least_norm(support, redundant, marks):
    x, y = 0.3, 0.1
    system = table((x, y), support)
    assert system.topology.analysis.redundant == redundant
    assert all(f"foot_{k}" in system.topology.analysis.redundant_names for k in range(4))
    loads = mbs.reactions(system, mbs.State.at(system))
    expected = 10.0 * 9.81 / 4.0 * (1.0 + x * FEET[:, 0] / 1.0 + y * FEET[:, 1] / 0.25)
    found = np.array([loads[f"foot_{k}"].force for k in range(4)])
    np.testing.assert_allclose(found, np.c_[np.zeros((4, 2)), expected], atol=1e-7)
    for k in range(4):
        np.testing.assert_array_equal(loads[f"foot_{k}"].unique_force, np.array(marks, bool))


@pytest.mark.long
def test_three_legs_are_determined():
    b = mbs.SystemBuilder()
    b.body("table", mass=10.0, com=(0.2, 0.1, 0.3), inertia=np.ones(3))
    b.joint("floats", mbs.Free(), "ground", "table")
    feet = np.array([[1.0, 0.0], [-0.5, 0.8], [-0.5, -0.8]])
    for k, (x, y) in enumerate(feet):
        b.constraint(f"foot_{k}", mbs.joints.PointOnPlane(), between=("ground", ("table", (x, y, 0.0))))
    system = b.build()
    loads = mbs.reactions(system, mbs.State.at(system))
    expected = np.linalg.solve(np.c_[np.ones(3), feet].T, 98.1 * np.array([1.0, 0.2, 0.1]))
    for k in range(3):
        np.testing.assert_allclose(loads[f"foot_{k}"].force, [0.0, 0.0, expected[k]], atol=1e-8)
        assert loads[f"foot_{k}"].unique_force.all()


# ----------------------------------------------------------------------------------- equilibrium of bodies
@jax.jit
def body_motions(system, state):
    """(R, x, angular velocity, angular acceleration, acceleration) by body, frame origins, and parents' reactions."""
    accelerations = mbs.forward_dynamics(system, state)[0]
    motions = {
        body: (
            mbs.rotation(system, state, body),
            mbs.position(system, state, body),
            mbs.kinematics.angular_velocity(system, state, body),
            mbs.dynamics.angular_acceleration(system, state, body, accelerations),
            mbs.dynamics.acceleration(system, state, body, accelerations),
        )
        for body in system.topology.body_names
    }
    frames = {name: mbs.position(system, state, name) for name in system.topology.frame_names}
    return motions, frames, mbs.reactions(system, state, side="parent")


def newton_euler(system, state, loads, others=None):
    """Largest gap of `sum of joint wrenches + gravity + other loads - h_dot`, body by body, in numpy.

    `others`: body -> list of (force, world point).  Uses poses, velocities and accelerations of bodies only.
    """
    top, gap = system.topology, 0.0
    motions, frames, parents = body_motions(system, state)
    for k, body in enumerate(top.body_names):
        R, x, w, alpha, a = (np.asarray(part) for part in motions[body])
        r = R @ np.asarray(system.com[k])
        a = a + np.cross(alpha, r) + np.cross(w, np.cross(w, r))
        mass, inertia = float(system.mass[k]), R @ np.asarray(system.inertia[k]) @ R.T
        force = mass * (np.asarray(system.gravity) - a)
        moment = -(inertia @ alpha + np.cross(w, inertia @ w))
        for joint in top.joints:
            for end, who, side in ((1, joint.child, loads), (0, joint.parent, parents)):
                if who == k:
                    point = np.asarray(frames[top.frame_names[joint.frames[end]]])
                    F, M = both(side, joint.name)
                    force, moment = force + F, moment + M + np.cross(point - x - r, F)
        for F, point in (others or {}).get(body, []):
            force, moment = force + F, moment + np.cross(point - x - r, F)
        gap = max(gap, np.abs(force).max(), np.abs(moment).max())
    return gap


@pytest.mark.long
def test_every_body_of_a_driven_loop_is_in_equilibrium():
    """Three redundant rows, a spring inside a pin, a load and a drive; also the drive's effort by power."""
    system = four_bar(drive=mbs.forces.Polynomial([0.7, 2.0, 1.5]), stiffness=3.0, load=5.0)
    _, B, D = four_bar_angles(0.7)
    state = mbs.State.at(system, guess={"A": 0.7, "B": B, "D": D})
    loads = mbs.reactions(system, state)
    tip = np.asarray(mbs.position(system, state, ("coupler", (0.9, 0.0, 0.0))))
    assert newton_euler(system, state, loads, {"coupler": [(np.array([0.0, 5.0, 0.0]), tip)]}) < 1e-7
    np.testing.assert_allclose(loads["D"].effort, [-3.0 * D], atol=1e-8)
    np.testing.assert_allclose(loads["D"].moment, [0.0, 0.0, -3.0 * D], atol=1e-8)
    for name in ("B", "C"):
        assert abs(loads[name].moment[2]) < 1e-8
    # Power of the drive = rate of the energy - powers of load and gravity - spring (all from a short motion).
    h = 1e-4
    motion = mbs.simulate(system, state, ts=jnp.array([h, 2 * h]))
    before = mbs.State.at(system, guess={"A": 0.7, "B": B, "D": D}, t=-h)
    energy = lambda s: float(mbs.dynamics.kinetic_energy(system, s) + mbs.dynamics.potential_energy(system, s))
    after = jax.tree.map(lambda x: x[0], motion.states)
    rate = (energy(after) - energy(before)) / (2 * h)
    load_power = 5.0 * float(mbs.velocity(system, state, ("coupler", (0.9, 0.0, 0.0)))[1])
    np.testing.assert_allclose(float(loads["A"].effort[0]) * 2.0, rate - load_power, rtol=1e-5)
    np.testing.assert_allclose(loads["A"].moment[2], loads["A"].effort[0], atol=1e-8)


@pytest.fixture(scope="module")
def random_tree():
    kinds = [
        mbs.Spherical(),
        mbs.Revolute(axis=(1.0, 0.2, -0.4)),
        mbs.Prismatic(axis=(-0.3, 0.1, 1.0)),
        mbs.Spherical(),
    ]
    links = rs.random_links(2, kinds)
    system = rs.build(links)
    return links, system, rs.random_state(system, 2)


@pytest.mark.long
def test_every_body_of_a_random_tree_is_in_equilibrium(random_tree):
    _, system, state = random_tree
    assert newton_euler(system, state, mbs.reactions(system, state)) < 1e-10


@pytest.mark.long
def test_joint_forces_of_pinocchio(random_tree):
    links, system, state = random_tree
    model = rs.pinocchio_model(links)
    data = model.createData()
    q, u = rs.pinocchio_coordinates(links, np.asarray(state.coordinates)), np.asarray(state.velocities)
    pin.rnea(model, data, q, u, np.array(mbs.forward_dynamics(system, state)[0]))
    loads = mbs.reactions(system, state, frame="joint")
    for k in range(len(links)):
        np.testing.assert_allclose(loads[f"j{k}"].force, data.f[k + 1].linear, atol=1e-9)
        np.testing.assert_allclose(loads[f"j{k}"].moment, data.f[k + 1].angular, atol=1e-9)


def test_reactions_along_a_motion_are_those_of_its_states(pendulum):
    system, state = pendulum
    second = mbs.State.at(system, pin=-0.9, velocities={"pin": 0.2})
    states = jax.tree.map(lambda *x: jnp.stack(x), state, second)
    together = mbs.reactions(system, states)
    assert together["pin"].force.shape == (2, 3)
    for k, one in enumerate((state, second)):
        np.testing.assert_allclose(together["pin"].force[k], mbs.reactions(system, one)["pin"].force, atol=1e-13)
    assert np.all(np.asarray(together.residual) < 1e-12)


@pytest.mark.long
def test_coupled_joints_carry_the_gear_load_inside():
    """Two flywheels geared 1 : -2: efforts +-lambda times the coefficients, moments of the pins the same."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    for name in ("one", "two"):
        b.body(name, mass=1.0, inertia=(0.2, 0.2, 0.3))
        b.joint(f"{name}_pin", PIN, "ground", name)
    b.constraint("gear", mbs.Coupler({"one_pin": 1.0, "two_pin": 2.0}))
    b.force("motor", mbs.Torque((0.0, 0.0, 6.0)), on="one")
    system = b.build()
    # one = -2 two; effective inertia at wheel two: 0.3 (1 + 4); torque there -12.
    a = mbs.forward_dynamics(system, mbs.State.at(system))[0]
    np.testing.assert_allclose(a, [16.0, -8.0], atol=1e-10)
    loads = mbs.reactions(system, mbs.State.at(system))
    np.testing.assert_allclose(loads["one_pin"].effort, [0.3 * 16.0 - 6.0], atol=1e-9)
    np.testing.assert_allclose(loads["two_pin"].effort, [0.3 * -8.0], atol=1e-9)


# --------------------------------------------------------------------------------------------- kinds of programs
@pytest.mark.long
def test_loads_do_not_depend_on_their_number(pendulum):
    """Loads of 1 000 and of 1 001 numbers agree to the last digit: no size chooses a compiler."""
    system, _ = pendulum
    angles = np.random.default_rng(0).normal(size=(1001, 1))
    states = mbs.State(jnp.zeros(1001), jnp.asarray(angles), jnp.asarray(2.0 * angles))
    more = mbs.reactions(system, states)["pin"].force
    fewer = mbs.reactions(system, jax.tree.map(lambda x: x[:1000], states))["pin"].force
    np.testing.assert_array_equal(fewer, more[:1000])
