"""Worm and wheel against the forces of the textbook: efficiency, self-locking, energy, slopes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.forces import PathKinematics, WormGear
from jaxmbs.friction import LuGre, SmoothCoulomb
from tests.differences import check_slopes

THREADS, TEETH, MODULE, RADIUS, ALPHA, MU = 2, 30, 4e-3, 0.02, np.radians(20.0), 0.08
LEAD = np.arctan(THREADS * MODULE / 2 / RADIUS)
STILL = jnp.zeros((2, 3))
DISTANCE = RADIUS + TEETH * MODULE / 2


def turned(angle):
    """Rotation about z."""
    c, s = jnp.cos(angle), jnp.sin(angle)
    return jnp.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


#: z to the axis of the wheel, y; x stays.
WHEEL = jnp.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def poses(a, b, place=(DISTANCE, 0.0, 0.0)):
    """The worm about z, the wheel beside it along x, about y."""
    return jnp.stack([turned(a), WHEEL @ turned(b)]), jnp.stack([jnp.zeros(3), jnp.asarray(place, float)])


def worm(**values):
    numbers = {"pressure_angle": ALPHA, "friction": MU, "stiffness": 1e7, "transition": 1e-9}
    return WormGear(THREADS, TEETH, MODULE, RADIUS, **(numbers | values))


def forces(law, angle, speed):
    """Wrenches where the worm has turned by a little more than the wheel, and both run."""
    sign = -1.0 if law.left_handed else 1.0
    spin = speed * jnp.array([[0.0, 0.0, 1.0], [0.0, -sign * THREADS / TEETH, 0.0]])
    return law.wrench(PathKinematics(*poses(angle, 0.0), spin, STILL), 0.0)


@pytest.mark.parametrize("left", [False, True])
def test_forces_and_efficiency_of_the_textbook(left):
    law, side = worm(left_handed=left), -1.0 if left else 1.0
    np.testing.assert_allclose(law.centre_distance, DISTANCE)
    force, moment = forces(law, 1e-4, 50.0)
    normal = 1e7 * np.cos(ALPHA) * np.cos(LEAD) * MODULE / 2 * THREADS * 1e-4
    about = normal * (np.cos(ALPHA) * np.sin(LEAD) + MU * np.cos(LEAD))
    along = normal * (np.cos(ALPHA) * np.cos(LEAD) - MU * np.sin(LEAD))
    np.testing.assert_allclose(force[1], [normal * np.sin(ALPHA), about, -side * along], rtol=1e-8)
    np.testing.assert_allclose(force[0], -force[1], rtol=1e-12)
    np.testing.assert_allclose(moment[0, 2], -RADIUS * about, rtol=1e-8)
    np.testing.assert_allclose(moment[1, 1], -side * (DISTANCE - RADIUS) * along, rtol=1e-8)
    efficiency = side * moment[1, 1] / moment[0, 2] * THREADS / TEETH
    expected = (np.cos(ALPHA) - MU * np.tan(LEAD)) / (np.cos(ALPHA) + MU / np.tan(LEAD))
    np.testing.assert_allclose(efficiency, expected, rtol=1e-8)


@pytest.mark.parametrize(("mu", "locks"), [(0.98, False), (1.02, True)])
def test_self_locking(mu, locks):
    """The wheel's load drives the worm back only if mu < cos(alpha) tan(lead)."""
    law = worm(friction=mu * np.cos(ALPHA) * np.tan(LEAD))
    _, moment = forces(law, 1e-4, -50.0)  # pressed on the drive flank, and running back
    assert (moment[0, 2] > 0) == locks  # against the rotation of the worm


def test_turns_shifts_and_play():
    law = worm(backlash=2e-5, friction=0.0)
    turns, shift = 2 * np.pi * np.array([11 + 1 / 2, -(4 + 7 / 30)]), np.pi * MODULE
    for place in ((DISTANCE, 0.0, 0.0), (DISTANCE, 0.0, 3 * shift)):
        for extra, pressed in ((0.0, False), (0.98, False), (1.02, True), (-1.02, True)):
            angle = turns[0] + extra * 1e-5 / (np.cos(ALPHA) * np.cos(LEAD) * MODULE / 2 * THREADS)
            force, _ = law.wrench(PathKinematics(*poses(angle, turns[1], place), STILL, STILL), 0.0)
            assert (np.abs(force).max() > 0.1) == pressed


@pytest.mark.long
def test_effort_is_minus_the_derivative_of_the_energy():
    law = worm(backlash=2e-5, friction=0.0, transition=1e-6)

    def at(p):
        return poses(p[0], p[1], (DISTANCE + p[2], p[3], p[4]))

    start = jnp.array([8e-3, 0.0, 1e-5, 2e-5, 3e-5])
    force, moment = law.wrench(PathKinematics(*at(start), STILL, STILL), 0.0)
    assert np.abs(force).max() > 1.0
    slope = -jax.grad(lambda p: law.potential(*at(p), 0.0))(start)
    np.testing.assert_allclose(slope[2:], force[1], rtol=1e-6)
    # both feel the force at one point, so that arms differ by the shifts of the centres
    np.testing.assert_allclose(slope[:2], [moment[0, 2], moment[1, 1]], rtol=2e-3)


def test_slopes_against_differences():
    home = {"pressure_angle": ALPHA, "mu": MU, "stiffness": 1e7, "backlash": 1e-5, "speed": 1.0}

    def torque(values):
        model = SmoothCoulomb(values["mu"], transition_speed=values["speed"])
        others = {name: values[name] for name in ("pressure_angle", "stiffness", "backlash")}
        return forces(worm(**others, friction=model, damping=100.0), 8e-3, 50.0)[1][0, 2]

    check_slopes(torque, home)


def test_an_earlier_name_warns_and_is_the_same():
    with pytest.warns(DeprecationWarning, match="slip_speed of a WormGear"):
        old = worm(friction=MU, slip_speed=0.5)
    assert float(old.friction.transition_speed) == 0.5 and old.slip_speed is None
    new = worm(friction=SmoothCoulomb(MU, transition_speed=0.5))
    np.testing.assert_allclose(forces(old, 8e-3, 50.0), forces(new, 8e-3, 50.0), rtol=1e-14)


def test_faults():
    for values, message in (
        ({"friction": -0.1}, "dynamic must not be negative"),
        ({"friction": LuGre(0.1, 1e3)}, "a worm gear has no state for the bristles of LuGre"),
        ({"friction": SmoothCoulomb(MU, transition_speed=0.0)}, "transition_speed must be positive"),
        ({"backlash": 1e-2}, "half a tooth pitch"),
    ):
        assert any(message in fault for fault in worm(**values).faults()), message
    assert any("whole numbers" in fault for fault in WormGear(0, 30, MODULE, RADIUS).faults())


@pytest.mark.long
def test_a_hoist_on_a_worm_gear():
    """A load on the wheel: the worm's motor gives its torque over ratio and efficiency, bearings the rest."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    for name, frame in (("worm", (0, 0, 0)), ("wheel", mbs.Pose((DISTANCE, 0, 0), np.asarray(WHEEL)))):
        b.body(name, 1.0, inertia=0.01)
        b.joint(name, mbs.Revolute("z"), "ground", name, parent_frame=frame)
    law = worm()
    b.force("mesh", law, between=("worm", "wheel"))
    system = b.build()
    state = mbs.State.at(system, worm=1e-4, velocities={"worm": 50.0, "wheel": -50.0 * THREADS / TEETH})
    efforts = mbs.inverse_dynamics(system, state, np.zeros(2))
    expected = (np.cos(ALPHA) - MU * np.tan(LEAD)) / (np.cos(ALPHA) + MU / np.tan(LEAD))
    np.testing.assert_allclose(efforts[1] / efforts[0] * THREADS / TEETH, expected, rtol=1e-8)
    force, _ = forces(law, 1e-4, 50.0)
    loads = mbs.reactions(system, state, accelerations=np.zeros(2), actuators=["worm", "wheel"])
    np.testing.assert_allclose(loads["wheel"].force, -force[1], rtol=1e-8)
