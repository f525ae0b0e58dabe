"""Gears in mesh against closed forms: loads of bearings, energy, a published oscillator with backlash."""

import json
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.forces import Actuator, GearPair, PathKinematics

CASE = Path(__file__).parent.parent / "cases" / "GB1_gear_backlash_oscillator.json"

ALPHA = np.radians(20.0)
STILL = jnp.zeros((2, 3))


def turned(angle):
    c, s = jnp.cos(angle), jnp.sin(angle)
    return jnp.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def poses(a, b, place):
    return jnp.stack([turned(a), turned(b)]), jnp.array([[0.0, 0.0, 0.0], place])


def pair(**values):
    return GearPair((20, 30), 2e-3, ALPHA, stiffness=1e7, transition=1e-9, **values)


@pytest.mark.long
def test_loads_are_tangential_and_radial_by_the_pressure_angle():
    """A torque on A presses its teeth on those of B: F_t = torque / r, F_r = F_t tan(alpha), apart."""
    law = pair()
    r_a, r_b = 0.02, 0.03
    np.testing.assert_allclose(law.radii, [r_a, r_b])
    force, moment = law.wrench(PathKinematics(*poses(1e-4, 0.0, [0.05, 0.0, 0.0]), STILL, STILL), 0.0)
    normal = 1e7 * r_a * np.cos(ALPHA) * 1e-4
    tangential, radial = normal * np.cos(ALPHA), normal * np.sin(ALPHA)
    np.testing.assert_allclose(force[1], [radial, tangential, 0.0], rtol=1e-9)  # A pushes B along y and away
    np.testing.assert_allclose(force[0], -force[1], rtol=1e-12)
    np.testing.assert_allclose(moment[:, 2], [-tangential * r_a, -tangential * r_b], rtol=1e-9)


@pytest.mark.long
def test_a_ring_gear_draws_its_pinion_to_its_centre():
    law = GearPair((20, 60), 2e-3, ALPHA, internal=True, stiffness=1e7, transition=1e-9)
    force, moment = law.wrench(PathKinematics(*poses(1e-4, 0.0, [0.04, 0.0, 0.0]), STILL, STILL), 0.0)
    normal = 1e7 * 0.02 * np.cos(ALPHA) * 1e-4
    np.testing.assert_allclose(force[0, 0], normal * np.sin(ALPHA), rtol=1e-9)
    np.testing.assert_allclose(np.abs(force[0, 1]), normal * np.cos(ALPHA), rtol=1e-9)
    np.testing.assert_allclose(moment[:, 2] / normal / np.cos(ALPHA), [-0.02, 0.06], rtol=1e-9)


@pytest.mark.long
def test_helical_gears_push_along_their_axes():
    """F_a = F_t tan(beta) and F_r = F_t tan(alpha_n) / cos(beta)."""
    beta = np.radians(15.0)
    law = pair(helix_angle=beta)
    distance = float(law.centre_distance)
    np.testing.assert_allclose(distance, 0.05 / np.cos(beta), rtol=1e-12)
    force, moment = law.wrench(PathKinematics(*poses(1e-4, 0.0, [distance, 0.0, 0.0]), STILL, STILL), 0.0)
    tangential = -float(moment[0, 2]) / float(law.radii[0])
    np.testing.assert_allclose(force[1, 1], tangential, rtol=1e-9)
    np.testing.assert_allclose(force[1, 0], tangential * np.tan(ALPHA) / np.cos(beta), rtol=1e-9)
    np.testing.assert_allclose(np.abs(force[1, 2]), tangential * np.tan(beta), rtol=1e-9)


def test_wheels_turn_many_times_and_their_centres_turn_about_each_other():
    """The mesh sees only angles from the line of centres, modulo a tooth."""
    law, psi = pair(), 0.7
    place = 0.05 * np.array([np.cos(psi), np.sin(psi), 0.0])
    a, b = psi + 2.0 * np.pi * 5 / 20 + 1e-4, psi + 2.0 * np.pi * 4 / 30
    wrench = mbs.jit(lambda path: law.wrench(path, 0.0))
    force, _ = wrench(PathKinematics(*poses(a, b, place), STILL, STILL))
    plain, _ = wrench(PathKinematics(*poses(1e-4, 0.0, [0.05, 0.0, 0.0]), STILL, STILL))
    np.testing.assert_allclose(force[1], turned(psi) @ plain[1], rtol=1e-8)


@pytest.mark.slow
def test_play_grows_with_the_distance_of_the_centres():
    """The exact involute: angles of free play against intersections of the flanks' base tangents."""
    law = pair(backlash=1e-5)
    distance = 0.0502
    base = np.array([0.02, 0.03]) * np.cos(ALPHA)
    working = np.arccos(base.sum() / distance)
    play = base.sum() * (np.tan(working) - working - np.tan(ALPHA) + ALPHA) + 5e-6
    for over, pressed in ((-1e-7, False), (1e-7, True)):
        angle = (play + over) / base[0]
        force, _ = law.wrench(PathKinematics(*poses(angle, 0.0, [distance, 0.0, 0.0]), STILL, STILL), 0.0)
        assert (np.abs(force).max() > 0.5) == pressed
        if pressed:
            np.testing.assert_allclose(force[1, 0] / force[1, 1], np.tan(working), rtol=1e-6)


@pytest.mark.long
def test_effort_is_minus_the_derivative_of_the_energy():
    law = pair(backlash=2e-5)
    start = jnp.array([2e-3, 0.01, 0.0501, 0.002])
    at = lambda p: poses(p[0], p[1], [p[2], p[3], 0.0])
    force, moment = law.wrench(PathKinematics(*at(start), STILL, STILL), 0.0)
    assert np.abs(force).max() > 1.0
    slope = jax.grad(lambda p: law.potential(*at(p), 0.0))(start)
    np.testing.assert_allclose(-slope, [moment[0, 2], moment[1, 2], force[1, 0], force[1, 1]], rtol=1e-9)


@pytest.mark.long
def test_gradients_against_differences():
    home = {"module": 2e-3, "pressure_angle": ALPHA, "stiffness": 1e7, "backlash": 1e-5, "damping": 100.0}
    spin = jnp.tile(jnp.array([[0.0, 0.0, 1.0]]), (2, 1))

    def torque(values):
        law = GearPair((20, 30), **values, transition=1e-9)
        return law.wrench(PathKinematics(*poses(3e-3, 0.0, [0.0501, 0.0, 0.0]), spin, STILL), 0.0)[1][0, 2]

    value, found = jax.jit(torque), jax.jit(jax.grad(torque))(home)
    for name, number in home.items():
        h = 1e-5 * number
        assert abs(found[name]) > 0
        difference = (value(home | {name: number + h}) - value(home | {name: number - h})) / (2 * h)
        np.testing.assert_allclose(found[name], difference, rtol=1e-5, err_msg=name)


@pytest.mark.long
def test_kahraman_and_singh():
    """Case GB1 at W = 1.2: from the separation of the teeth through a flight to the impact, and once around."""
    z, mean, amplitude, W = 0.05, 0.1, 0.05, 1.2
    base, unit = 0.02 * np.cos(ALPHA), 1e-2  # half of the backlash [m] is the unit of x
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("wheel", 1.0, inertia=base**2)
    b.joint("pin", mbs.Revolute("z"), "ground", "wheel")
    b.force("bearing", mbs.SpringDamper(damping=2 * z * base**2), joint="pin")
    b.force("drive", Actuator(lambda x, v, t: base * unit * (mean + amplitude * W**2 * jnp.cos(W * t))), joint="pin")
    b.gear_pair(
        "mesh",
        "wheel",
        ("ground", (0.05, 0, 0)),
        (2, 3),
        2e-2,
        ALPHA,
        stiffness=1.0,
        backlash=2 * unit,
        transition=1e-4 * unit,
    )
    system = b.build()
    case = json.loads(CASE.read_text(encoding="utf-8"))["outputs"]
    case = {row["quantity"]: row["value"] for row in case}
    start, speed, flight, impact, greatest, least = (
        case[f"W 1.2: {name}"]
        for name in (
            "time of separation (phase of cos)",
            "speed at separation",
            "length of the flight",
            "speed at impact",
            "greatest x",
            "least x",
        )
    )
    state = mbs.State.at(system, pin=unit / base, velocities={"pin": speed * unit / base}, t=start)
    period = 2 * np.pi / W
    ts = start + np.unique([*np.linspace(0.0, period, 4001), flight])
    motion = mbs.simulate(system, state, ts=ts, rtol=1e-9, atol=1e-9)
    x, v = (
        np.asarray(values)[:, 0] * base / unit for values in (motion.states.coordinates, motion.states.velocities)
    )
    at = np.searchsorted(ts, start + flight)
    np.testing.assert_allclose([x[at], v[at]], [1.0, impact], atol=2e-5)
    np.testing.assert_allclose([x[-1], v[-1]], [1.0, speed], atol=2e-5)
    np.testing.assert_allclose([x.max(), x.min()], [greatest, least], atol=2e-5)
