"""Contacts that stick: presliding, sliding and rolling against SciPy and closed forms, their heat and derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import jaxmbs as mbs
from jaxmbs import contact as C
from jaxmbs.friction import LuGre

G, K, DAMPING = 9.81, 1e5, 2.0
BRISTLES = LuGre(0.3, 300.0, 6.0, 0.1, 0.39, 0.02)
RADIUS = 0.05
POSES = {
    "spheres": (C.SphereOnSphere(0.1, 0.2), (0.1, 0.2, 0.199)),
    "journal": (C.JournalInBush(0.01, 1e-3, 0.02), (9e-4, 2e-4, 0.01)),
}


def contact(name):
    return C.Contact(POSES[name][0], C.HuntCrossley(1e6, 1.5, 0.3, 2e-4), BRISTLES)


def motion_of(name):
    spin, velocity = jnp.array([0.2, -0.4, 0.3]), jnp.array([0.05, 0.03, -0.02])
    return (
        jnp.asarray(Rotation.from_rotvec([0.03, -0.02, 0.4]).as_matrix()),
        jnp.asarray(POSES[name][1]),
        spin,
        velocity,
    )


@jax.jit
def evaluate(law, R, x, w, v, bend, poses):
    """The contact at one instant: touch, tangential bends (k, 3), their rates, slip, and normals at other poses."""
    at = law.pair.touch(R, x)
    z = jnp.cross(at.normal, bend[None])
    rate = law.rate(R, x, w, v, {"bristle": z}, 0.0)["bristle"]
    return at, z, rate, law.normal_forces(R, x, w, v).sliding, [law.pair.touch(*pose).normal for pose in poses]


@pytest.mark.parametrize("name", ["spheres", pytest.param("journal", marks=pytest.mark.long)])
def test_bends_stay_in_the_tangent_plane_and_turn_with_it(name):
    """The rate of `z . n` is zero, and the rate of |z| that of LuGre alone."""
    R, x, w, v = motion_of(name)
    h, bend = 1e-7, np.array((3e-4, 5e-4, -4e-4))
    poses = [(Rotation.from_rotvec(list(s * h * w)).as_matrix() @ R, x + s * h * v) for s in (1.0, -1.0)]
    at, z, rate, slip, (later, before) = jax.tree.map(np.asarray, evaluate(contact(name), R, x, w, v, bend, poses))
    turning = (later - before) / (2 * h)
    np.testing.assert_allclose(np.sum(turning * z + at.normal * rate, axis=1), 0.0, atol=1e-9)
    speed = np.linalg.norm(slip, axis=1)
    g = 0.3 * (1.0 + 0.3 * np.exp(-((speed / 0.02) ** 2)))
    expected = np.sum(z * slip, axis=1) - speed * 300.0 / g * np.sum(z * z, axis=1)
    expected = np.where(at.depth <= 0.0, -0.02 * 300.0 / 0.3 * np.sum(z * z, axis=1), expected)
    np.testing.assert_allclose(np.sum(z * rate, axis=1), expected, rtol=1e-10)


def block(model=BRISTLES, slope=0.2):
    """A block that slides along x and presses on a slope by a point."""
    b = mbs.SystemBuilder(gravity=G * np.array([np.sin(slope), 0.0, -np.cos(slope)]))
    b.body("carriage", 0.0)
    b.body("block", 2.0)
    b.joint("x", mbs.Prismatic("x"), "ground", "carriage")
    b.joint("z", mbs.Prismatic("z"), "carriage", "block")
    b.contact("slope", C.SphereOnPlane(0.0), "block", "ground", C.HuntCrossley(K, 1.0, DAMPING), model)
    return b.build(), -2.0 * G * np.cos(slope) / K


def along_the_slope(slope, v, times):
    """x, velocity and bend of the block by SciPy; its depth is that of its weight."""
    normal = 2.0 * G * np.cos(slope)

    def rates(t, y):
        _, v, z = y
        dz = v - abs(v) * z * 300.0 / (0.3 * (1.0 + 0.3 * np.exp(-((v / 0.02) ** 2))))
        return v, G * np.sin(slope) - normal / 2.0 * (300.0 * z + 6.0 * dz + 0.1 * v), dz

    return solve_ivp(rates, (0.0, times[-1]), (0.0, v, 0.0), "Radau", times, rtol=1e-10, atol=1e-13).y


TIMES = np.linspace(0.0, 0.8, 41)


@pytest.mark.long
@pytest.mark.parametrize("slope, v", [(0.2, 0.0), (0.2, 0.5), (0.6, 0.0)], ids=["sticks", "stops", "slides"])
def test_a_block_on_a_slope(slope, v):
    system, z = block(slope=slope)
    motion = mbs.simulate(system, mbs.State.at(system, {"z": z}, {"x": v}), ts=TIMES, rtol=1e-9, atol=1e-12)
    assert motion.ok
    x, u = np.asarray(motion.states.coordinates)[:, 0], np.asarray(motion.states.velocities)[:, 0]
    bend = np.asarray(motion.internal("slope.bristle"))[:, 0]
    truth = along_the_slope(slope, v, TIMES)
    for found, exact in zip((x, u, bend[:, 0]), truth, strict=True):
        np.testing.assert_allclose(found, exact, rtol=0.0, atol=1e-6 * np.abs(exact).max())
    np.testing.assert_allclose(bend[:, 1:], 0.0, atol=1e-15)
    normal, load = 2.0 * G * np.cos(slope), mbs.dynamics.contact_load(system, motion, "slope")
    np.testing.assert_allclose(load.normal_force[:, 0], normal, rtol=1e-9)
    if slope == 0.2:
        assert abs(u[-1]) < 1e-5
        np.testing.assert_allclose(load.friction[-1, 0, 0], -2.0 * G * np.sin(slope), rtol=1e-3)
        np.testing.assert_allclose(bend[-1, 0], np.tan(slope) / 300.0, rtol=1e-3)
    else:
        np.testing.assert_allclose(-load.friction[-1, 0, 0], normal * (0.3 + 0.1 * u[-1]), rtol=1e-6)
    found = mbs.bondgraph.element_powers(system, motion)
    assert np.min(found.dissipated["slope"]) > -1e-15
    scale = np.abs(np.asarray(found.mechanical["slope"])).max()
    np.testing.assert_allclose(found.residual["slope"], 0.0, atol=1e-12 * scale)
    assert np.abs(motion.diagnostics.energy_residual).max() < 1e-7


@pytest.mark.long
@pytest.mark.parametrize("slope", [0.2, 0.6])
def test_derivatives_of_a_motion(slope):
    """By the coefficient, the stiffness of the bristles and the speed at the start."""
    _, z = block(slope=slope)

    def end(p):
        system, _ = block(LuGre(p[0], p[1], 6.0, 0.1, 1.3 * p[0], 0.02), slope)
        start = mbs.State.at(system, {"z": z}, {"x": p[2]})
        motion = mbs.simulate(system, start, ts=[0.1, 0.2], rtol=1e-10, atol=1e-13)
        return motion.states.coordinates[-1, 0]

    p, end = jnp.array([0.3, 300.0, 0.3]), jax.jit(end)
    reverse = jax.grad(end)(p)
    for k, h in enumerate((1e-4, 0.1, 1e-4)):
        step = h * np.eye(3)[k]
        difference = (8.0 * (end(p + step) - end(p - step)) - end(p + 2 * step) + end(p - 2 * step)) / (12.0 * h)
        np.testing.assert_allclose(reverse[k], difference, rtol=2e-6)


@pytest.mark.long
def test_a_ball_that_rolls_through_a_tube_turns_its_bristles():
    """Sticking, a ball swings in a tube as `7/5 (R - r) a = -g sin a` says, within the way of presliding."""
    gap, radius = 0.2, RADIUS
    b = mbs.SystemBuilder(gravity=(0.0, -G, 0.0))
    b.body("ball", 1.0, inertia=0.4 * radius**2)
    b.joint("ball", mbs.Planar("z"), "ground", "ball")
    model = LuGre(0.8, 2e5, 300.0)
    b.contact("tube", C.SphereInCylinder(radius, gap), "ball", "ground", C.HuntCrossley(1e7, 1.0, 0.2), model)
    system, a = b.build(), 0.5
    at = (gap + 9.81 * np.cos(a) / 1e7) * np.array([np.sin(a), -np.cos(a)])
    start = mbs.State.at(system, {"ball": (*at, 0.0)})
    times = np.linspace(0.0, 1.0, 21)
    motion = mbs.simulate(system, start, ts=times, rtol=1e-8, atol=1e-11)
    truth = solve_ivp(
        lambda t, y: (y[1], -G * np.sin(y[0]) / (1.4 * gap)), (0, 1.0), (a, 0.0), "DOP853", times, rtol=1e-10
    )
    x, y = np.asarray(motion.states.coordinates)[:, :2].T
    np.testing.assert_allclose(np.arctan2(x, -y), truth.y[0], atol=1e-3)


def test_wrong_parts():
    force = C.HuntCrossley(1e6)
    with pytest.warns(DeprecationWarning, match="contact.Contact"):
        assert type(C.BristleContact(C.SphereOnPlane(0.1), force, BRISTLES)) is C.Contact
    with pytest.raises(TypeError, match="friction must be a model with bristles, got float"):
        C.BristleContact(C.SphereOnPlane(0.1), force, 0.3)
    smooth = C.Contact(C.SphereOnPlane(0.1), force, 0.3)
    assert not (smooth.internal_states or smooth.holds or smooth.has_storage_beside)
    b = mbs.SystemBuilder()
    b.body("ball", 1.0)
    b.joint("ball", mbs.Free(), "ground", "ball")
    wrong = LuGre(-1.0, -1.0, -1.0, -1.0, -2.0, 0.0)
    b.contact("a", C.SphereOnPlane(0.1), "ball", "ground", force, wrong)
    with pytest.raises(mbs.ModelError) as found:
        b.build()
    for text in (
        "dynamic must not be negative",
        "sigma0 must be positive",
        "sigma1 must not be",
        "sigma2 must not be",
    ):
        assert f"force 'a': friction: {text}" in str(found.value)
    assert "static must be at least dynamic" in str(found.value)
    assert "stribeck_speed must be positive" in str(found.value)
