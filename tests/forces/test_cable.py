"""Cables against closed forms, MuJoCo's tendons (case CB1), Euler and Eytelwein (CT2), and their own energy."""

import json
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.forces import (
    Attachment,
    Cable,
    Eyelet,
    InextensibleCable,
    PathKinematics,
    Ramp,
    Sheave,
    WrapCylinder,
    WrapSphere,
)
from jaxmbs.forces._cable_path import Circles
from jaxmbs.forces._common_tangent import common_tangents
from jaxmbs.friction import SmoothCoulomb
from jaxmbs.math._rotation import rotation_matrix
from jaxmbs.math._vector import VectorComponents, cross, dot

CASES = Path(__file__).parent.parent / "cases"
CB1 = json.loads((CASES / "CB1_cable_over_cylinder_and_sphere.json").read_text(encoding="utf-8"))
CB1 = {row["quantity"]: row["value"] for row in CB1["outputs"]}


def law_of(path, **values):
    """The law of a cable over elements whose frames do not matter."""
    b = mbs.SystemBuilder()
    b.cable("c", path, **({"stiffness": 1e4} | values))
    assert not b._faults, b._faults
    return b.declared.forces["c"].law


def at(places, turns=None):
    """Rotations and places of frames."""
    places = jnp.asarray(places, float)
    return jnp.tile(jnp.eye(3), (len(places), 1, 1)) if turns is None else jax.vmap(rotation_matrix)(turns), places


def still(n):
    return jnp.zeros((n, 3)), jnp.zeros((n, 3))


@pytest.mark.long
@pytest.mark.parametrize("kind", ["cylinder", "sphere"])
def test_lengths_and_moment_arms_of_mujoco(kind):
    element = {"cylinder": WrapCylinder, "sphere": WrapSphere}[kind]
    law = law_of([Attachment(""), element("", 0.08, axis="y"), Attachment("")])

    def path(angle):
        end = jnp.array([0.25 + 0.3 * jnp.cos(angle), -0.05, -0.3 * jnp.sin(angle)])
        return law.path(*at([[-0.4, 0.03, 0.02], [0.0, 0.0, 0.0], end]))

    for angle in (0.3, 0.6, 0.9, 1.2):
        names = ("length m", "d length / d angle m", "wrap angle in the plane rad")
        expected = [CB1[f"{kind}, arm {angle} rad: {name}"] for name in names]
        length, arm = jax.jvp(lambda a: path(a).length, (angle,), (1.0,))
        np.testing.assert_allclose([length, path(angle).wrap[1]], expected[::2], atol=1e-9)
        np.testing.assert_allclose(arm, expected[1], atol=1e-7)


@pytest.mark.parametrize(
    ("mu", "turns", "high"),
    [pytest.param(0.2, 0, 187.4456087585338, marks=pytest.mark.long), (0.35, 1, 2707.6664984516074)],
)
def test_capstan(mu, turns, high):
    """Case CT2: the high side for 100 N at the low side, half a turn and one and a half."""
    law = law_of([Attachment(""), Sheave("", 0.1, "+", "y", turns), Attachment("")], friction=mu, free_length=1.5)
    speeds = jnp.array([[0, 0, -1.0], [0, 0, 0], [0, 0, 1.0]])  # the cable runs towards the first end
    path = PathKinematics(*at([[-0.1, 0, -1], [0, 0, 0], [0.1, 0, -1]]), jnp.zeros((3, 3)), speeds)
    found = mbs.jit(lambda path: law.state(path, 0.0))(path)
    np.testing.assert_allclose(found.wrap[1], np.pi * (1 + 2 * turns), rtol=1e-14)
    np.testing.assert_allclose(100.0 * found.tensions[0] / found.tensions[1], high, rtol=1e-9)


@pytest.mark.long
def test_a_wrap_beyond_half_a_turn():
    """Both ends cross below the wheel: the angle by hand, and with whole turns more."""
    distance = np.hypot(0.2, 1.0)
    wanted = 2 * np.pi - 2 * np.arccos(0.1 / distance) + 2 * np.arctan(0.2)
    for turns in (0, 2):
        law = law_of([Attachment(""), Sheave("", 0.1, "+", "y", turns), Attachment("")])
        path = law.path(*at([[0.2, 0, -1], [0, 0, 0], [-0.2, 0, -1]]))
        np.testing.assert_allclose(path.wrap, [0.0, wanted + 2 * np.pi * turns, 0.0], rtol=1e-13)
        np.testing.assert_allclose(path.length, 0.1 * path.wrap[1] + 2 * np.sqrt(distance**2 - 0.01), rtol=1e-13)


CRANE = (
    [Attachment(""), Sheave("", 0.2, "+", (0.0, 1.0, 0.1)), Sheave("", 0.3, "-", "y"), Eyelet("")]
    + [Sheave("", 0.15, "+", (0.2, 1.0, 0.0)), Attachment("")],
    [[0.0, 0.0, 0.0], [1.0, 0.1, 2.0], [3.0, 0.0, 1.0], [4.0, 0.2, 1.2], [5.0, 0.1, 2.0], [6.0, 0.0, 0.3]],
)


def moved(law, shift):
    """Poses of the crane's frames after shifts (6, 6) of place and turn."""
    return at(jnp.asarray(CRANE[1]) + shift[:, :3], shift[:, 3:])


@pytest.mark.long
def test_effort_is_minus_the_derivative_of_the_energy():
    """Of wheels whose planes differ too: the length's derivative, turn by turn and shift by shift."""
    law = law_of(CRANE[0], free_length=6.0)
    force, moment = law.wrench(PathKinematics(*moved(law, jnp.zeros((6, 6))), *still(6)), 0.0)
    energy = jax.jit(lambda s: law.potential(*moved(law, s), 0.0))
    found, h = np.concatenate([force, moment], axis=1), 1e-6
    for k in range(6):
        for j in range(6):
            e = np.zeros((6, 6))
            e[k, j] = h
            slope = (energy(e) - energy(-e)) / (2 * h)
            np.testing.assert_allclose(found[k, j], -slope, rtol=1e-6, atol=2e-4)
    np.testing.assert_allclose(np.sum(found[:, :3], axis=0), 0.0, atol=1e-9)


@pytest.mark.long
def test_friction_and_damping_take_energy_at_every_rate():
    law = law_of(CRANE[0], free_length=6.0, friction=0.3, damping=50.0)
    R, x = moved(law, jnp.zeros((6, 6)))
    speeds = np.random.default_rng(1).normal(size=(200, 2, 6, 3)) * 0.1

    def power(speeds):
        spin, velocity = speeds
        force, moment = law.wrench(PathKinematics(R, x, spin, velocity), 0.0)
        rate = law.state(PathKinematics(R, x, spin, velocity), 0.0).rate
        elastic = 1e4 * (law.path(R, x).length - 6.0)
        return jnp.sum(force * velocity) + jnp.sum(moment * spin) + elastic * rate

    taken = -np.asarray(jax.jit(jax.vmap(power))(jnp.asarray(speeds)))
    assert taken.min() > -1e-9 and taken.max() > 10.0


@pytest.mark.long
def test_a_cable_without_tension_is_slack_and_never_pushes():
    law = law_of([Attachment(""), Attachment("")], damping=1e4, free_length=1.0, transition=1e-3)
    strut = law_of([Attachment(""), Attachment("")], damping=1e4, free_length=1.0, slack=False)
    away = jnp.array([[0, 0, 0], [-5.0, 0, 0]])
    for length, expected in ((0.9, 0.0), (1.1, 1e3)):
        force = law.wrench(PathKinematics(*at([[0, 0, 0], [length, 0, 0]]), *still(2)), 0.0)[0]
        np.testing.assert_allclose(force[0, 0], expected, rtol=1e-12)
        quick = law.wrench(PathKinematics(*at([[0, 0, 0], [length, 0, 0]]), still(2)[0], away), 0.0)[0]
        assert 0.0 <= quick[0, 0] <= expected
    np.testing.assert_allclose(
        strut.wrench(PathKinematics(*at([[0, 0, 0], [0.9, 0, 0]]), *still(2)), 0.0)[0][0, 0], -1e3
    )


@pytest.mark.long
def test_the_corner_is_twice_differentiable():
    law = law_of([Attachment(""), Attachment("")], free_length=1.0, transition=1e-3)
    tension = lambda x: law.wrench(PathKinematics(*at([[0, 0, 0], [x, 0, 0]]), *still(2)), 0.0)[0][0, 0]
    second = jax.jit(jax.grad(jax.grad(lambda x: tension(x))))
    for corner in (1.0 - 1e-3, 1.0 + 1e-3):
        np.testing.assert_allclose(second(corner - 1e-9), second(corner + 1e-9), atol=1e-4 * 1e4 / 1e-3)


@pytest.mark.long
def test_a_belt_drives_by_friction():
    """Two wheels: length by the closed form, torques (T_1 - T_2) r, ratio of tensions at most exp(mu wrap)."""
    law = law_of(
        [Sheave("", 0.1), Sheave("", 0.2)],
        closed=True,
        free_length=2.0,
        friction=SmoothCoulomb(0.25, transition_speed=1e-2),
        pretension=400.0,
    )
    R, x = at([[0, 0, 0], [0.6, 0, 0]])
    tilt = np.arcsin(0.1 / 0.6)
    length = 2 * 0.6 * np.cos(tilt) + np.pi * 0.3 + 2 * tilt * 0.1
    np.testing.assert_allclose(law.path(R, x).length, length, rtol=1e-12)
    for spin, has_slip in ((1.01, False), (30.0, True)):
        spins = jnp.array([[0, 0, 2.0 * spin], [0, 0, 1.0]])
        found = law.state(PathKinematics(R, x, spins, jnp.zeros((2, 3))), 0.0)
        force, moment = law.wrench(PathKinematics(R, x, spins, jnp.zeros((2, 3))), 0.0)
        difference = found.tensions[1] - found.tensions[0]
        assert difference > 1.0
        np.testing.assert_allclose(moment[:, 2], [-0.1 * difference, 0.2 * difference], rtol=1e-9)
        limit = np.exp(0.25 * (np.pi - 2 * tilt))
        ratio = found.tensions[1] / found.tensions[0]
        assert abs(ratio - limit) < 1e-9 if has_slip else ratio < 0.9 * limit
        assert moment[0, 2] * spins[0, 2] + moment[1, 2] * spins[1, 2] < 0.0


@pytest.mark.long
def test_a_winch_pays_out():
    law = law_of([Attachment(""), Attachment("")], free_length=Ramp(1.0, 0.1), damping=20.0)
    force = law.wrench(PathKinematics(*at([[0, 0, 0], [1.1, 0, 0]]), *still(2)), 0.5)[0]
    np.testing.assert_allclose(force[0, 0], 1e4 * 0.05 - 20.0 * 0.1, rtol=1e-12)
    assert law.is_source and not law.stores


GRADIENTS = {"radii": 1e-6, "stiffness": 1.0, "free_length": 1e-6, "friction": 1e-6, "damping": 1e-2, "place": 1e-6}


@pytest.mark.long
def test_gradients_against_differences():
    law = law_of(CRANE[0], free_length=6.0, friction=0.3, damping=50.0)
    R, x = moved(law, jnp.zeros((6, 6)))
    spin, velocity = jnp.asarray(np.random.default_rng(2).normal(size=(2, 6, 3)))
    weight = jnp.asarray(np.random.default_rng(3).normal(size=(2, 6, 3)))

    def force(by):
        coefficients = lambda c: [model.dynamic for model in c.friction]
        fields = lambda c: [c.radii, c.stiffness, c.free_length.value, c.damping, *coefficients(c)]
        change = [
            by["radii"],
            by["stiffness"],
            by["free_length"],
            by["damping"],
            *[by["friction"]] * len(law.friction),
        ]
        here = eqx.tree_at(fields, law, [a + d for a, d in zip(fields(law), change, strict=True)])
        found = here.wrench(PathKinematics(R, x.at[2, 0].add(by["place"]), spin, velocity), 0.0)
        return jnp.sum(jnp.stack(found) * weight)

    at_home, value = dict.fromkeys(GRADIENTS, 0.0), jax.jit(force)
    found = jax.jit(jax.grad(force))(at_home)
    for name, h in GRADIENTS.items():
        assert abs(found[name]) > 1e-3, name
        difference = (value(at_home | {name: h}) - value(at_home | {name: -h})) / (2 * h)
        np.testing.assert_allclose(found[name], difference, rtol=1e-6, err_msg=name)


REGIMES = {"taut": (1.0, 2.0), "slack": (1.0, 12.0), "grazing": (0.02, 1.9), "corner": (1.0, None)}


@pytest.mark.long
@pytest.mark.parametrize("regime", REGIMES)
def test_gradients_on_a_grid_of_regimes(regime):
    """Forces by the height of a wheel: taut, slack, in the corner between them, and with hardly any wrap."""
    height, free = REGIMES[regime]
    path = [Attachment(""), Sheave("", 0.2, "+", (0.0, 1.0, 0.1)), Attachment("")]
    ends = [[-1.0, 0.0, -0.2], [1.0, 0.1, -0.2]]

    def poses(z):
        return at([ends[0], jnp.array([0.0, 0.0, z - 0.2]), ends[1]])

    free = float(law_of(path).path(*poses(height)).length) - 2e-4 if free is None else free
    law = law_of(path, free_length=free, transition=1e-3)
    force = jax.jit(lambda z: jnp.stack(law.wrench(PathKinematics(*poses(z), *still(3)), 0.0)).reshape(-1))
    slope = jax.jit(jax.jacfwd(force))
    for z in height + np.array([0.0, 1e-5, 1e-4]):
        h = 1e-5 if regime == "corner" else 1e-4
        # Richardson: fourth and higher differences of the step vanish
        one, two, four = ((force(z + k * h) - force(z - k * h)) / (2 * k * h) for k in (1, 2, 4))
        better = (64 * one - 20 * two + four) / 45
        scale = max(1.0, float(jnp.abs(better).max()))
        np.testing.assert_allclose(slope(z) / scale, better / scale, atol=1e-8)
        assert (regime == "slack") == (scale == 1.0)


@pytest.mark.long
def test_slopes_of_the_length_against_differentiation():
    """The closed form beside derivatives of the length itself, of wheels whose planes differ."""
    law = law_of(CRANE[0])
    R, x = moved(law, 0.02 * jnp.asarray(np.random.default_rng(4).normal(size=(6, 6))))

    @jax.jit
    def both(R, x):
        length = lambda d: law.path(jax.vmap(rotation_matrix)(d[:, 3:]) @ R, x + d[:, :3]).length
        return jax.grad(length)(jnp.zeros((6, 6))), law.length_and_rate(PathKinematics(R, x, *still(6)))[2:]

    expected, found = both(R, x)
    np.testing.assert_allclose(np.concatenate(found, axis=1), expected, atol=1e-13)


@pytest.mark.long
def test_stored_power_is_the_rate_of_the_energy():
    """Alone and with the wrench, of stretched and slack cables, with friction and damping beside it."""
    rng = np.random.default_rng(8)
    for free, friction in ((6.0, None), (6.0, 0.3), (9.0, None)):
        law = law_of(CRANE[0], free_length=free, friction=friction, damping=50.0)
        R, x = moved(law, jnp.zeros((6, 6)))
        frames = PathKinematics(R, x, *jnp.asarray(rng.normal(size=(2, 6, 3))))

        @jax.jit
        def energy(h, law=law, R=R, x=x, frames=frames):
            turned = jax.vmap(rotation_matrix)(h * frames.angular_velocities) @ R
            return law.potential(turned, x + h * frames.velocities, 0.0)

        h = 1e-5
        wrench, power = jax.jit(lambda f, law=law: law.wrench_and_storage_power(f, 0.0))(frames)
        np.testing.assert_allclose(power, (energy(h) - energy(-h)) / (2 * h), rtol=1e-7, atol=1e-12)
        np.testing.assert_allclose(power, law.storage_power(frames, 0.0), rtol=1e-12)
        np.testing.assert_allclose(wrench, law.wrench(frames, 0.0), rtol=1e-12, atol=1e-9)


@pytest.mark.long
def test_tangents_of_wheels_whose_axes_differ():
    """Axes up to 57 degrees from parallel, open and crossed: spans are at right angles to both radii."""
    rng, size = np.random.default_rng(3), 2000
    axis, about, way = (v / np.linalg.norm(v, axis=1)[:, None] for v in rng.normal(size=(3, size, 3)))
    lean = rng.uniform(-0.5, 0.5, size=(size, 1))  # of either axis out of the right angle to the way
    way = np.cross(axis, way)
    way /= np.linalg.norm(way, axis=1)[:, None]
    turn = np.asarray(jax.vmap(rotation_matrix)(jnp.asarray(about * rng.uniform(-1.0, 1.0, size=(size, 1)))))
    other = np.einsum("nij,nj->ni", turn, axis) * rng.choice([-1.0, 1.0], size=(size, 1))
    axis = axis + 0.3 * lean * way
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    radii = jnp.asarray(rng.uniform(0.1, 0.35, size=(2, size)))
    place = VectorComponents.of(jnp.asarray(way * rng.uniform(1.5, 4.0, size=(size, 1))))

    def circles(place, radius, axis):
        return Circles(place, radius, VectorComponents.of(jnp.asarray(axis)), jnp.zeros(size))

    first, second = circles(place * 0.0, radii[0], axis), circles(place, radii[1], other)
    n, m = jax.jit(common_tangents, static_argnums=2)(first, second, None)
    span = place + m * second.radius - n * first.radius
    for normal, circle in ((n, first), (m, second)):
        for across in (dot(normal, span), dot(normal, circle.axis), dot(normal, normal) - 1.0):
            np.testing.assert_allclose(across, 0.0, atol=1e-12)
    assert np.all(dot(cross(first.axis, n), span) > 0) and np.all(dot(cross(second.axis, m), span) > 0)


@pytest.mark.long
@pytest.mark.parametrize("element", [Sheave, WrapCylinder, WrapSphere])
def test_a_point_within_a_wheel_is_told(element):
    """By elastic and inextensible cables."""
    law = law_of([Attachment(""), element("", 0.2, axis="z", side="+"), Attachment("")])
    row = InextensibleCable(law.kinds, law.radii, law.axes, law.turns, free_length=4.0)
    for first, wanted in ((-1.0, [True, True]), (-0.1, [False, True])):
        frames = PathKinematics(*at([[first, 0.05, 0.0], [0.0, 0.0, 0.0], [1.0, 0.05, 0.0]]), *still(3))
        np.testing.assert_array_equal(law.state(frames, 0.0).is_tangent, wanted)
        np.testing.assert_array_equal(row.state(frames, jnp.asarray(1.0)).is_tangent, wanted)


def test_a_span_without_a_tangent_is_told():
    """From a point within a wheel, and between wheels that overlap; of neighbours that have one nothing is said."""
    law = law_of([Attachment(""), Sheave("", 0.2, "+"), Sheave("", 0.2, "-"), Attachment("")])
    for places, wanted in (
        ([[-1, 0, 0], [0, 0, 0], [1, 0, 0], [2, 0, 0]], [True, True, True]),
        ([[-0.1, 0, 0], [0, 0, 0], [1, 0, 0], [2, 0, 0]], [False, True, True]),
        ([[-1, 0, 0], [0, 0, 0], [0.3, 0, 0], [2, 0, 0]], [True, False, True]),
    ):
        state = law.state(PathKinematics(*at(places), *still(4)), 0.0)
        np.testing.assert_array_equal(state.is_tangent, wanted)


def test_values_that_no_cable_has():
    ends = [Attachment("a"), Attachment("b")]
    b = mbs.SystemBuilder()
    b.cable("one", [ends[0], Sheave("c", 0.1, side="left"), ends[1]], stiffness=1.0)
    b.cable("two", [ends[0], "wheel", ends[1]], stiffness=1.0)
    b.cable("three", [*ends, Attachment("c")], stiffness=1.0)
    words = ("side is '+' or '-'", "'wheel' is not Attachment", "an Attachment is an end")
    assert all(word in fault for word, fault in zip(words, b._faults, strict=True)), b._faults
    for path, values, word in (
        (ends, {"stiffness": -1.0}, "stiffness must be positive"),
        (ends, {"axial_stiffness": 1.0}, "give stiffness= or axial_stiffness="),
        ([ends[0], Sheave("c", -0.1), ends[1]], {}, "radii must be positive"),
        ([ends[0], WrapCylinder("c", 0.1), Sheave("c", 0.1), ends[1]], {}, "stands between two points"),
        ([Sheave("c", 0.1), ends[1]], {}, "the ends are points"),
        (ends, {"free_length": 0.0}, "free_length must be positive"),
    ):
        assert any(word in fault for fault in law_of(path, **values).faults()), word
    assert isinstance(law_of(ends), Cable)
