"""Contacts of every pair between two poses: energy, dissipation, derivatives in every regime, and moving ones."""

import itertools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.special import gamma

import jaxmbs as mbs
from jaxmbs import contact as C
from jaxmbs.forces._ports import PosePort
from jaxmbs.friction import BrownMcPhee, SmoothCoulomb

TURN = Rotation.from_rotvec([0.03, -0.02, 0.4]).as_matrix()
X = np.linspace(-1.0, 1.0, 9)
WAVES = C.HeightField(X, 0.02 * np.sin(3.0 * X)[:, None] + 0.02 * np.cos(2.0 * X), X)


def cam(n=24):
    angles = 2.0 * np.pi * np.arange(n) / n
    return C.ClosedCurve(np.c_[0.03 * np.cos(angles) + 0.004 * np.cos(2.0 * angles), 0.03 * np.sin(angles)])


PAIRS = {  # a pair and a displacement about which it just touches, pressed along the last vector
    "plane": (C.SphereOnPlane(0.1), (0.2, 0.1, 0.1), (0, 0, -1)),
    "spheres": (C.SphereOnSphere(0.1, 0.2), (0.1, 0.2, 0.2), (-1 / 3, -2 / 3, -2 / 3)),
    "tube": (C.SphereInCylinder(0.1, 0.01), (0.006, 0.008, 0.3), (0.6, 0.8, 0)),
    "cylinder": (C.CylinderOnPlane(0.1, 0.3), (0.1, 0.2, 0.153484598), (0, 0, -1)),
    "journal": (C.JournalInBush(0.01, 1e-3, 0.02), (8.36879885e-4, 1.58398e-5, 0.01), (0.6, 0.8, 0)),
    "cam": (C.RollerOnCurve(cam(), 0.01), (0.033499529, 0.023787207, 0.0), (-0.71588122, -0.69822209, 0)),
    "road": (
        C.WheelOnRoad(WAVES, 0.3),
        (0.09996949, 0.2000082192, 0.3248411127),
        (0.05628748, -0.01516346, -0.99829945),
    ),
}
FORCE = C.HuntCrossley(1e6, 1.5, 0.3, transition=2e-4)
FRICTION = BrownMcPhee(0.3, 0.42, 0.01)
DEPTHS = (-5e-4, 0.0, 1e-4, 2e-3)  # beyond the pose of PAIRS [m]: apart, grazing, at its beginning, pressed
SPEEDS = (0.0, 1e-4, 4e-3, 1e-2, 0.5)  # sliding [m/s]: stick, slow and fast creep, the top of the curve, slide
WEIGHTS = np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / 60.0
PORT = PosePort()
SLOW = ("cam", "road")
parametrise = pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.long] * (name in SLOW)) for name in PAIRS]
)


def contact(name):
    return C.Contact(PAIRS[name][0], FORCE, FRICTION)


def pose(name, depth):
    _, place, along = PAIRS[name]
    return jnp.asarray(TURN), jnp.asarray(place, float) + depth * jnp.asarray(along, float)


@jax.jit
def answers(law, R, d, flow):
    """Effort at rest, that of the potential, and power lost."""
    effort = lambda flow: PORT.effort(law, (R, d), flow, 0.0)
    lost = effort(flow) @ flow + PORT.storage_power(law, (R, d), flow, 0.0)
    return effort(0.0 * flow), PORT.stored_effort(law, (R, d), flow, 0.0), lost


@jax.jit
def slopes(law, R, at, steps):
    """Derivatives of the effort by displacement and flow: forward, reverse, by central differences of order six."""
    effort = lambda x: PORT.effort(law, (R, x[:3]), x[3:], 0.0)
    along = lambda e, h: (jax.vmap(lambda k: effort(at + k * h * e))(np.arange(-3.0, 4.0)).T @ WEIGHTS) / h
    differences = jax.vmap(along, (0, 0), 1)(np.eye(9), steps)
    return jax.jacfwd(effort)(at), jax.jacrev(effort)(at), differences


def flow_of(speed):
    return jnp.concatenate([3.0 * speed * jnp.array([0.3, -0.2, 0.5]), speed * jnp.array([0.8, 0.5, -0.33])])


@parametrise
def test_energy_and_dissipation(name):
    rng = np.random.default_rng(1)
    for depth in (-1e-3, 1e-4, 3e-3):
        R, d = pose(name, depth)
        still, stored, lost = answers(contact(name), R, d, jnp.asarray(rng.normal(size=6)))
        np.testing.assert_allclose(still, stored, rtol=1e-9, atol=1e-11)
        assert lost <= 1e-12


@pytest.mark.long
@pytest.mark.parametrize("name", PAIRS)
def test_derivatives_in_every_regime(name):
    """To 1e-8 of differences; grazing, steps are short, as the force starts with a high power."""
    for depth, speed in itertools.product(DEPTHS, SPEEDS):
        R, d = pose(name, depth)
        steps = np.r_[np.full(3, 1e-8 if depth == 0.0 else 2e-6), np.full(6, 2e-5 if speed < 0.1 else 2e-3)]
        forward, reverse, differences = slopes(contact(name), R, jnp.r_[d, flow_of(speed)], jnp.asarray(steps))
        for part in (slice(0, 3), slice(3, 9)):
            scale = max(float(np.abs(forward[:, part]).max()), 1.0)
            np.testing.assert_allclose(forward[:, part], differences[:, part], rtol=0.0, atol=1e-8 * scale)
            np.testing.assert_allclose(forward[:, part], reverse[:, part], rtol=0.0, atol=1e-12 * scale)
        if depth < 0.0:
            np.testing.assert_array_equal(forward, 0.0)


def balls():
    """Two balls of steel on one line."""
    stiffness = C.hertz_stiffness((0.02, 0.03), (2.1e11, 2.1e11), (0.3, 0.3))
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    for name, mass in (("small", 0.26), ("large", 0.88)):
        b.body(name, mass)
        b.joint(name, mbs.Prismatic("x"), "ground", name)
    b.contact("hit", C.SphereOnSphere(0.02, 0.03), "small", "large", C.HuntCrossley(stiffness))
    return b.build(), float(stiffness)


@pytest.mark.long
def test_two_balls_touch_for_the_time_of_hertz():
    system, k = balls()
    mass, v = 0.26 * 0.88 / 1.14, 0.9
    largest = (5.0 * mass * v**2 / (4.0 * k)) ** 0.4
    duration = 2.0 * np.sqrt(np.pi) * gamma(1.4) / gamma(0.9) * largest / v
    start = mbs.State.at(system, {"small": 0.0, "large": 0.05}, {"small": v, "large": 0.0})
    ts = np.array([duration / 2, duration * (1 - 1e-3), duration * (1 + 1e-3)])
    motion = mbs.simulate(system, start, ts=ts, rtol=1e-10, atol=1e-12)
    depth = mbs.dynamics.contact_load(system, motion, "hit").depth[:, 0]
    np.testing.assert_allclose(depth[0], largest, rtol=1e-8)
    assert depth[1] > 0 > depth[2]
    u = np.asarray(motion.states.velocities)
    np.testing.assert_allclose(u @ [0.26, 0.88], 0.26 * v, rtol=1e-10)
    np.testing.assert_allclose(u[2, 1] - u[2, 0], v, rtol=1e-8)


def slope_with_ball(mu, slope=0.35, speed=1e-2):
    """A ball on a slope, at the depth of its weight."""
    b = mbs.SystemBuilder(gravity=9.81 * np.array([np.sin(slope), 0.0, -np.cos(slope)]))
    b.body("ball", 1.0, inertia=0.4 * 0.05**2)
    b.joint("ball", mbs.Free(), "ground", "ball")
    b.contact(
        "slope",
        C.SphereOnPlane(0.05),
        "ball",
        "ground",
        C.HuntCrossley(1e6, 1.0),
        SmoothCoulomb(mu, transition_speed=speed),
    )
    return b.build(), 9.81 * np.cos(slope) / 1e6


@pytest.mark.long
def test_a_ball_rolls_below_the_critical_slope_and_slides_beyond():
    """`2/7 tan(slope)` is the coefficient that rolling needs."""
    for mu in (0.2, 0.05):
        system, depth = slope_with_ball(jnp.asarray(mu))
        start = mbs.State.at(system, {"ball": (0.0, 0.0, 0.05 - depth, 1.0, 0.0, 0.0, 0.0)})
        motion = mbs.simulate(system, start, ts=[0.2, 0.3], rtol=1e-9, atol=1e-10)
        velocity = np.asarray(mbs.velocity(system, motion, "ball"))[:, 0]
        spin = np.asarray(mbs.kinematics.angular_velocity(system, motion, "ball"))[:, 1]
        arm = 0.05 - depth / 2
        rolls = mu > 2.0 / 7.0 * np.tan(0.35)
        drive = 9.81 * np.sin(0.35)
        rolling = drive / (1.0 + 0.4 * (0.05 / arm) ** 2)
        sliding = drive - mu * 9.81 * np.cos(0.35)
        np.testing.assert_allclose(np.diff(velocity)[0] / 0.1, rolling if rolls else sliding, rtol=1e-6)
        spin_up = rolling / arm if rolls else mu * 9.81 * np.cos(0.35) * arm / (0.4 * 0.05**2)
        np.testing.assert_allclose(np.diff(spin)[0] / 0.1, spin_up, rtol=1e-6)


def test_wrong_parts():
    with pytest.raises(TypeError, match="pair must be of AbstractPair"):
        C.Contact(0.1, FORCE)
    with pytest.raises(TypeError, match="friction must be a coefficient or a model"):
        C.Contact(C.SphereOnPlane(0.1), FORCE, "rough")
    b = mbs.SystemBuilder()
    b.body("ball", 1.0)
    b.joint("ball", mbs.Free(), "ground", "ball")
    b.contact("a", C.SphereOnPlane(-0.1), "ball", "ground", C.HuntCrossley(-1.0, 0.5, transition=-1.0))
    b.contact("b", C.SphereOnPlane(0.1), "ball", "ground", None)
    b.contact("c", C.SphereOnPlane(0.1), "ball", "ground", FORCE, SmoothCoulomb(-0.1, -0.5, 0.0), -1.0, -1.0)
    with pytest.raises(mbs.ModelError) as found:
        b.build()
    for text in (
        *("force 'a': pair: radius must not be negative", "force: stiffness must not be negative"),
        *(
            "exponent must be at least 1",
            "transition must not be negative",
            "contact 'b': force must be of HuntCrossley",
        ),
        *(
            "friction: dynamic must not be negative",
            "static must be at least dynamic",
            "transition_speed must be positive",
        ),
        *("max_depth must be positive", "wear must not be negative"),
    ):
        assert text in str(found.value)


@pytest.mark.parametrize("name, shape", [("slopes", (9, 9)), ("slopes", (3, 9, 8)), ("heights", (9,)), ("x", (8,))])
def test_parts_of_a_height_field_that_do_not_go_together(name, shape):
    broken = eqx.tree_at(lambda field: getattr(field, name), WAVES, jnp.zeros(shape))
    assert WAVES.faults() == [] and "do not go with places" in broken.faults()[0]


@pytest.mark.parametrize("name, shape", [("slopes", (23, 2)), ("points", (24, 3)), ("points", (7, 2))])
def test_parts_of_a_closed_curve_that_do_not_go_together(name, shape):
    broken = eqx.tree_at(lambda curve: getattr(curve, name), cam(), jnp.zeros(shape))
    assert cam().faults() == [] and "do not go together" in broken.faults()[0]
