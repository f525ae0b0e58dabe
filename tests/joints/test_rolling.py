"""Rows of velocity: rolling spheres and disks, the benchmark bicycle, carts, rows of the user."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs

G = 9.81


def upright(position=(0.0, 0.0, 0.0), rotation=(1.0, 0.0, 0.0, 0.0)):
    """Coordinates of a free joint."""
    return np.concatenate([position, rotation])


def sphere(gravity=(0.0, 0.0, -G), turntable=None, radius=0.2, mass=3.0):
    b = mbs.SystemBuilder(gravity=gravity)
    b.body("ball", mass=mass, inertia=0.4 * mass * radius**2)
    b.joint("free", mbs.Free(), "ground", "ball")
    if turntable is not None:
        b.body("table", mass=1.0, inertia=1.0)
        b.joint("axle", mbs.Revolute(axis="z"), "ground", "table", drive=mbs.forces.Polynomial([0.0, turntable]))
    plane = "ground" if turntable is None else "table"
    b.constraint("contact", mbs.joints.RollingSphere(radius), between=(plane, "ball"))
    return b.build()


def disk(radius=0.3, mass=2.0):
    b = mbs.SystemBuilder()
    turning = mass * radius**2 * np.array([0.25, 0.5, 0.25])
    b.body("disk", mass=mass, inertia=turning)
    b.joint("free", mbs.Free(), "ground", "disk")
    b.constraint("contact", mbs.joints.RollingDisk(radius), between=("ground", "disk"))
    return b.build()


def rolling_rates(system, state, spin):
    """Velocities (6,) of a free body whose contact holds, from its angular velocity in body axes."""
    A = np.asarray(mbs.constraints.constraint_jacobian(system, state))[:, :6]
    return np.concatenate([np.linalg.solve(A[:, :3], -A[:, 3:] @ spin), spin])


@pytest.mark.long
def test_a_sphere_on_an_incline_takes_five_sevenths_of_the_slope():
    slope = 0.3
    system = sphere(gravity=(G * np.sin(slope), 0.0, -G * np.cos(slope)))
    assert system.topology.mobility == 3
    state = mbs.State.at(system, free=upright((0.0, 0.0, 0.2)))
    np.testing.assert_allclose(
        mbs.dynamics.acceleration(system, state, "ball"), [5.0 / 7.0 * G * np.sin(slope), 0.0, 0.0], atol=1e-10
    )
    force = mbs.reactions(system, state)["contact"].force
    np.testing.assert_allclose(force, 3.0 * G * np.array([-2.0 / 7.0 * np.sin(slope), 0.0, np.cos(slope)]), rtol=1e-9)


@pytest.mark.long
def test_a_ball_on_a_turntable_goes_in_circles_at_two_sevenths_of_its_rate():
    """The centre obeys v' = (2/7) Omega x v: one circle in 3.5 turns of the table."""
    rate = 3.0
    system = sphere(turntable=rate)
    start = np.array([0.1, 0.0])
    contact = rate * np.array([0.0, 0.5])  # velocity of the table there; omega x (-r z) = contact - start
    spin = np.array([(contact - start)[1], -(contact - start)[0], 0.0]) / 0.2
    state = mbs.State.at(
        system, free=upright((0.5, 0.0, 0.2)), velocities={"free": np.concatenate([start, [0.0], spin])}
    )
    period = 2 * np.pi / (2.0 / 7.0 * rate)
    motion = mbs.simulate(system, state, ts=np.array([period / 4, period]), rtol=1e-11, atol=1e-11)
    velocity = np.asarray(jax.vmap(lambda s: mbs.velocity(system, s, "ball"))(motion.states))
    np.testing.assert_allclose(velocity, [[0.0, 0.1, 0.0], [0.1, 0.0, 0.0]], atol=1e-9)
    np.testing.assert_allclose(motion.states.coordinates[-1, :2], [0.5, 0.0], atol=1e-9)


@pytest.mark.long
def test_a_leaning_disk_keeps_its_energy_over_a_hundred_turns():
    system, lean = disk(), 0.3
    turned = (np.cos(lean / 2), np.sin(lean / 2), 0.0, 0.0)
    state = mbs.State.at(system, free=upright((0.0, 0.0, 0.3 * np.cos(lean)), turned))
    rates = rolling_rates(system, state, np.array([0.1, 6.0, 0.5]))
    state = mbs.State.at(system, free=state.coordinates, velocities={"free": rates})
    motion = mbs.simulate(system, state, t1=100 * 2 * np.pi / 6.0)
    accounts = motion.diagnostics
    total = accounts.kinetic + accounts.potential
    assert np.max(np.abs(accounts.energy_residual)) < 1e-9 * np.max(np.abs(total))
    assert max(np.max(accounts.constraint_drift), np.max(accounts.velocity_drift)) < 1e-12


@pytest.mark.long
def test_a_disk_rolls_steadily_on_a_circle():
    """The balance of moments about the centre, by hand, fixes the spin for a lean and a rate of precession."""
    m, r, lean, precession = 2.0, 0.3, 0.4, 1.5
    system = disk(r, m)
    turned = (np.cos(lean / 2), np.sin(lean / 2), 0.0, 0.0)
    place = upright((0.0, 0.0, r * np.cos(lean)), turned)
    # Angular velocity (0, spin, precession cos(lean)) in axes that lean with the disk but do not spin.
    diameter, axle = 0.25 * m * r**2, 0.5 * m * r**2
    normal = precession * np.cos(lean)
    spin = (diameter * precession * np.sin(lean) - m * G * r * np.sin(lean) / normal) / (axle + m * r**2)
    state = mbs.State.at(system, free=place)
    rates = rolling_rates(system, state, np.array([0.0, spin, normal]))
    state = mbs.State.at(system, free=place, velocities={"free": rates})
    motion = mbs.simulate(system, state, t1=2.0, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(motion.states.coordinates[:, 2], r * np.cos(lean), atol=1e-8)


@pytest.mark.long
def test_a_blade_as_rows_of_the_user():
    """`VelocityRows` on the coordinates give the motion of the `KnifeEdge`."""
    ends = []
    for law, between in ((mbs.joints.KnifeEdge(), ("ground", "sleigh")), (mbs.joints.VelocityRows(across), None)):
        b = mbs.SystemBuilder(gravity=(1.0, 0.0, 0.0))
        b.body("sleigh", mass=1.2, com=(0.3, 0.0, 0.0), inertia=0.15)
        b.joint("plane", mbs.Planar(), "ground", "sleigh")
        b.constraint("blade", law, between=between)
        system = b.build()
        state = mbs.State.at(system, plane=np.zeros(3), velocities={"plane": np.array((1.0, 0.0, 2.0))})
        ends.append(mbs.simulate(system, state, t1=1.0).states.coordinates[-1])
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-9)


def roller_racer(looped):
    """Two sleighs at a hitch whose angle is driven; the second one hangs on the first, or closes a loop with it."""
    b = mbs.SystemBuilder()
    for name in ("front", "rear"):
        b.body(name, mass=1.0, com=(0.1, 0.0, 0.0), inertia=0.05)
        b.constraint(f"blade_{name}", mbs.joints.KnifeEdge(), between=("ground", name))
    b.joint("plane", mbs.Planar(), "ground", "front")
    ends = {"parent_frame": (0.5, 0.0, 0.0), "child_frame": (0.4, 0.0, 0.0)}
    drive = mbs.forces.Harmonic(np.pi, 0.6, 3.0)
    b.joint("hitch", mbs.Revolute(axis="z"), "front", "rear", drive=drive, **ends)
    if looped:
        b.joint("other", mbs.Planar(), "ground", "rear")
    return b.build()


@pytest.mark.long
def test_loop_rolling_and_drive_together():
    """The loop through a joint that restricts nothing changes no motion, and the blades' forces neither."""
    systems = [roller_racer(looped) for looped in (False, True)]
    for system, looped in zip(systems, (False, True), strict=True):
        assert system.topology.mobility == 1
        assert bool(system.topology.cut_joints) == looped
    motion = mbs.simulate(systems[1], mbs.State.at(systems[1], plane=np.zeros(3)), t1=2.0, rtol=1e-10, atol=1e-10)
    place = np.asarray(jax.vmap(lambda s: mbs.position(systems[1], s, "rear"))(motion.states))
    assert np.ptp(place[:, 0]) > 0.01  # it travels
    assert np.max(np.abs(motion.diagnostics.energy_residual)) < 1e-8
    states = jax.tree.map(lambda x: x[::20], motion.states)
    open_tree, with_loop = (
        jax.vmap(lambda s, system=system: mbs.forward_dynamics(system, s)[0])(states) for system in systems
    )
    np.testing.assert_allclose(open_tree, with_loop, atol=1e-6)
    loads = [mbs.reactions(system, states) for system in systems]
    for blade in ("blade_front", "blade_rear"):
        planar = [np.asarray(load[blade].force)[:, :2] for load in loads]
        np.testing.assert_allclose(*planar, atol=1e-6)


def across(coordinates, velocities, t):
    heading = coordinates[2]
    return -jnp.sin(heading) * velocities[0] + jnp.cos(heading) * velocities[1]


def cart(steer=0.0):
    """Four wheels, the front pair steered by a driven angle: rolling, a drive and redundant contacts together."""
    b = mbs.SystemBuilder()
    b.body("cart", mass=10.0, inertia=(0.5, 1.0, 1.2))
    b.joint("free", mbs.Free(), "ground", "cart")
    half, radius = 0.25, 0.1
    for end, x in (("rear", -0.4), ("front", 0.4)):
        for side, y in (("left", half), ("right", -half)):
            name, at = f"{end}_{side}", (x, y, 0.0)
            b.body(name, mass=0.5, inertia=(0.002, 0.004, 0.002))
            carrier = "cart"
            if end == "front" and steer:
                carrier, turn = f"knuckle_{side}", np.arctan(0.8 / (0.8 / np.tan(steer) - y))
                b.body(carrier, mass=0.2, inertia=0.001)
                b.joint(
                    f"king_{side}",
                    mbs.Revolute(axis="z"),
                    "cart",
                    carrier,
                    parent_frame=at,
                    drive=mbs.forces.Polynomial([turn]),
                )
                at = (0.0, 0.0, 0.0)
            b.joint(name, mbs.Revolute(axis="y"), carrier, name, parent_frame=at)
            b.constraint(f"tyre_{name}", mbs.joints.RollingDisk(radius), between=("ground", name))
    return b.build()


@pytest.mark.long
def test_a_cart_with_steered_wheels_turns_about_the_axles_meeting_point():
    steer = 0.5
    system = cart(steer)
    assert system.topology.mobility == 1
    assert system.topology.analysis.redundant > 0
    state = mbs.State.at(system, free=upright((0.0, 0.0, 0.1)), velocities={"rear_left": np.array(10.0)})
    centre = np.array([-0.4, 0.8 / np.tan(steer)])
    turning = float(mbs.kinematics.angular_velocity(system, state, "cart")[2])
    velocity = np.asarray(mbs.velocity(system, state, "cart"))[:2]
    expected = turning * np.array([centre[1], -centre[0]])
    np.testing.assert_allclose(velocity, expected, atol=1e-10)
    assert abs(turning) > 0.1


@pytest.mark.parametrize(
    "law, words",
    [
        (mbs.joints.RollingDisk(0.0), "radius"),
        (mbs.joints.RollingSphere(-1.0), "radius"),
        (mbs.joints.RollingDisk(1.0, axle=(0, 0, 0)), "axis"),
        (mbs.joints.KnifeEdge(along=(0, 0, 0)), "axis"),
    ],
)
def test_wrong_contacts_are_refused(law, words):
    b = mbs.SystemBuilder()
    b.body("body", mass=1.0, inertia=1.0)
    b.joint("free", mbs.Free(), "ground", "body")
    b.constraint("contact", law, between=("ground", "body"))
    with pytest.raises(mbs.ModelError, match=words):
        b.build()


@pytest.mark.long
def test_a_ball_rolls_the_way_it_turns():
    """Spin about +y carries it along +x, spin about +x along -y."""
    system = sphere(radius=0.2)
    state = mbs.State.at(system, free=upright((0.0, 0.0, 0.2)))
    np.testing.assert_allclose(rolling_rates(system, state, np.array([0.0, 3.0, 0.0]))[:3], [0.6, 0, 0], atol=1e-12)
    np.testing.assert_allclose(rolling_rates(system, state, np.array([3.0, 0.0, 0.0]))[:3], [0, -0.6, 0], atol=1e-12)


@pytest.mark.long
def test_rows_of_velocity_that_depend_on_time():
    """A belt whose speed swings carries a block along."""
    b = mbs.SystemBuilder()
    b.body("block", mass=2.0, inertia=0.1)
    b.joint("slide", mbs.Prismatic("x"), "ground", "block")
    b.constraint("belt", mbs.joints.VelocityRows(lambda psi, u, t: u - 0.5 * jnp.sin(2.0 * t)))
    system = b.build()
    state = mbs.State.at(system, t=0.4)
    np.testing.assert_allclose(state.velocities, 0.5 * np.sin(0.8), rtol=1e-12)
    acceleration, push = mbs.forward_dynamics(system, state)
    np.testing.assert_allclose([acceleration, push], [[np.cos(0.8)], [2.0 * np.cos(0.8)]], rtol=1e-12)
