"""Special joints and constraints in one model, each against its closed form: accelerations and a short motion."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jaxmbs as mbs
from tests.models import PIN, rotation_about

G, PITCH, SLOPE = 9.81, 0.05, 0.6
SPIN = np.array([0.8, 0.3, 2.0])  # body axes, of a body with inertia (2, 2, 3)


def _parabola(coordinates, t):
    return (coordinates[_AT[1]] - coordinates[_AT[0]] ** 2)[None]


_AT: list[int] = []


def declare():
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -G))
    b.body("nut", mass=2.0, inertia=(0.01, 0.01, 0.02))
    b.joint("screw", mbs.Screw(axis="z", pitch=PITCH), "ground", "nut")
    for name, inertia in (("gear_1", 0.1), ("gear_2", 0.4)):
        b.body(name, mass=1.0, inertia=inertia * np.ones(3))
        b.joint(f"{name}_pin", PIN, "ground", name)
    b.constraint("gears", mbs.Coupler({"gear_1_pin": 1.0, "gear_2_pin": 3.0}))
    b.force("motor", mbs.Torque((0.0, 0.0, 5.0)), on="gear_1")
    b.body("top", mass=1.5, com=(0.0, 0.0, 0.1), inertia=(2.0, 2.0, 3.0))
    b.joint("top_free", mbs.Free(), "ground", "top")
    # Two equal pendulums of a point mass: one on a hinge, one on a massless rod.
    b.body("hinged", mass=1.0, com=(0.0, 0.0, -0.7))
    b.joint("hinge", mbs.Revolute(axis="y"), "ground", "hinged")
    b.body("roped", mass=1.0, inertia=np.ones(3))
    b.joint("roped_plane", mbs.Planar(normal="y"), "ground", "roped")
    b.constraint("rope", mbs.joints.Distance(0.7), between=("ground", "roped"))
    # Beads on a tilted wire, on a tilted plane and on a parabola.
    tilt = mbs.Pose((0.0, 0.0, 0.0), rotation_about((0, 1, 0), np.pi / 2 + SLOPE))
    plane = mbs.Pose((0.0, 0.0, 0.0), rotation_about((0, 1, 0), SLOPE))
    for name in ("wire", "plane"):
        b.body(name, mass=1.0, inertia=np.ones(3))
        b.joint(f"{name}_free", mbs.Free(), "ground", name)
    b.constraint("on_wire", mbs.joints.PointOnLine(), between=(("ground", tilt), "wire"))
    b.constraint("on_plane", mbs.joints.PointOnPlane(), between=(("ground", plane), "plane"))
    b.body("carrier", mass=0.5)
    b.body("bead", mass=0.5)
    b.joint("along", mbs.Prismatic(axis="x"), "ground", "carrier")
    b.joint("up", mbs.Prismatic(axis="z"), "carrier", "bead")
    b.constraint("parabola", mbs.joints.PositionRows(_parabola))
    return b


@pytest.fixture(scope="module")
def started():
    _AT[:] = _coordinates_of("along", "up")
    system = declare().build()
    values = {
        "hinge": 0.5,
        "roped_plane": _planar(0.5),
        "along": 0.4,
        "top_free": np.r_[np.zeros(3), 1.0, np.zeros(3)],
        "wire_free": np.r_[np.zeros(3), 1.0, np.zeros(3)],
    }
    rates = {
        "screw": 1.0,
        "hinge": 0.3,
        "along": 0.2,
        "top_free": np.r_[0.1, 0.2, 3.0, SPIN],
        "roped_plane": _planar_rate(0.5, 0.3),
    }
    return system, mbs.State.at(system, values, velocities=rates, guess={"up": 0.16})


def _coordinates_of(*joints):
    """Indices of joint coordinates, which do not depend on the constraints."""
    b = declare()
    b._model.constraints.clear()
    records = {j.name: j for j in b.build().topology.joints}
    return [records[name].first_coordinate for name in joints]


def _planar(angle):
    """Coordinates of the point at an angle about y from the downward vertical; the plane's axes are z and x."""
    x, z = -0.7 * np.sin(angle), -0.7 * np.cos(angle)
    return np.array([z, x, 0.0])


def _planar_rate(angle, rate):
    return rate * np.array([0.7 * np.sin(angle), -0.7 * np.cos(angle), 0.0])


@pytest.fixture(scope="module")
def accelerations(started):
    system, state = started
    a = np.asarray(mbs.forward_dynamics(system, state)[0])
    return {j.name: a[j.velocities] for j in system.topology.joints}


@pytest.mark.long
def test_screw(accelerations):
    """Falling a pitch per radian: (I + m p^2) a = -m g p."""
    np.testing.assert_allclose(accelerations["screw"], -2.0 * G * PITCH / (0.02 + 2.0 * PITCH**2), rtol=1e-12)


@pytest.mark.long
def test_gear_pair(accelerations):
    """q1 = -3 q2: torque 5 on wheel 1 against I1 + I2 / 9."""
    a = 5.0 / (0.1 + 0.4 / 9.0)
    np.testing.assert_allclose(accelerations["gear_1_pin"], a, rtol=1e-9)
    np.testing.assert_allclose(accelerations["gear_2_pin"], -a / 3.0, rtol=1e-9)


@pytest.mark.long
def test_hinged_pendulum(accelerations):
    np.testing.assert_allclose(accelerations["hinge"], -G / 0.7 * np.sin(0.5), rtol=1e-12)


@pytest.mark.long
def test_roped_pendulum(accelerations):
    """The same tangential and centripetal acceleration."""
    alpha, w = -G / 0.7 * np.sin(0.5), 0.3
    x = -0.7 * (np.cos(0.5) * alpha - np.sin(0.5) * w**2)
    z = 0.7 * (np.sin(0.5) * alpha + np.cos(0.5) * w**2)
    np.testing.assert_allclose(accelerations["roped_plane"], [z, x, 0.0], atol=1e-9)


@pytest.mark.long
def test_bead_on_a_wire_and_on_a_plane(accelerations):
    """Both slopes fall along (cos, 0, -sin): g sin(slope) along them; nothing turns."""
    expected = G * np.sin(SLOPE) * np.array([np.cos(SLOPE), 0.0, -np.sin(SLOPE)])
    for name in ("wire_free", "plane_free"):
        np.testing.assert_allclose(accelerations[name], np.r_[expected, np.zeros(3)], atol=1e-9)


@pytest.mark.long
def test_bead_on_a_parabola(accelerations):
    """Mass 1 along x, 0.5 along z = x^2: (1 + 0.5 (2x)^2) a + 0.5 2x 2 v^2 = -0.5 g 2x."""
    x, v = 0.4, 0.2
    a = -(0.5 * G * 2 * x + 0.5 * 2 * x * 2 * v**2) / (1.0 + 0.5 * 4 * x**2)
    np.testing.assert_allclose(accelerations["along"], a, rtol=1e-9)
    np.testing.assert_allclose(accelerations["up"], 2 * x * a + 2 * v**2, rtol=1e-9)


@pytest.fixture(scope="module")
def motion(started):
    return mbs.simulate(*started, ts=jnp.array([0.25, 0.5]), rtol=1e-11, atol=1e-11)


@pytest.mark.long
def test_pendulums_stay_together(started, motion):
    """By position of the mass, after half a second."""
    place = jax.vmap(lambda s: mbs.position(started[0], s, ("hinged", (0.0, 0.0, -0.7))))(motion.states)
    other = jax.vmap(lambda s: mbs.position(started[0], s, "roped"))(motion.states)
    np.testing.assert_allclose(place, other, atol=1e-9)
    assert np.ptp(np.asarray(place)[:, 0]) > 0.1


@pytest.mark.long
def test_free_symmetric_top(started, motion):
    """The centre of mass flies a parabola; the body spins steadily seen from axes that precess in the body."""
    system = started[0]
    t = np.asarray(motion.ts)
    com = jax.vmap(lambda s: mbs.position(system, s, ("top", (0.0, 0.0, 0.1))))(motion.states)
    v = np.array([0.1, 0.2, 3.0]) + np.cross(SPIN, [0.0, 0.0, 0.1])
    path = np.array([0.0, 0.0, 0.1]) + t[:, None] * v - 0.5 * G * t[:, None] ** 2 * np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(com, path, atol=1e-8)
    # R(t) = exp(t L / I1) exp(t (1 - I3 / I1) w3 z): turn about the fixed angular momentum, then about the own axis.
    L = np.array([2.0, 2.0, 3.0]) * SPIN
    for k in range(2):
        R = Rotation.from_rotvec(t[k] * L / 2.0) * Rotation.from_rotvec([0.0, 0.0, t[k] * (1 - 1.5) * SPIN[2]])
        one = jax.tree.map(lambda x, k=k: x[k], motion.states)
        np.testing.assert_allclose(mbs.rotation(system, one, "top"), R.as_matrix(), atol=1e-8)


@pytest.mark.long
def test_everything_keeps_its_energy_and_its_constraints(motion):
    """The motor's torque works on the gears; its power is in the account."""
    diagnostics = motion.diagnostics
    assert np.max(np.abs(np.asarray(diagnostics.energy_residual))) < 1e-7
    assert np.max(np.asarray(diagnostics.constraint_drift)) < 1e-12
    a = 5.0 / (0.1 + 0.4 / 9.0)
    np.testing.assert_allclose(diagnostics.work["motor"], 5.0 * 0.5 * a * np.asarray(motion.ts) ** 2, rtol=1e-7)


@pytest.mark.long
def test_screw_motion(started, motion):
    a = -2.0 * G * PITCH / (0.02 + 2.0 * PITCH**2)
    t = np.asarray(motion.ts)
    angle = t + 0.5 * a * t**2
    np.testing.assert_allclose(started[0].coordinates(motion.states)["screw"], angle, atol=1e-8)
    height = jax.vmap(lambda s: mbs.position(started[0], s, "nut"))(motion.states)[:, 2]
    np.testing.assert_allclose(height, PITCH * angle, atol=1e-8)
