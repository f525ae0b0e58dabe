"""Closed poses of joints that are redundant by themselves: two of a kind in line, whose rows hold rounding alone."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jaxmbs as mbs
from jaxmbs.joints import ALL
from tests.models import four_bar_angles

AXIS = np.array([1.0, 2.0, 3.0]) / 14.0**0.5
PAIRS = {  # joint, and the directions along which a second one may lie
    "Revolute": (mbs.Revolute(AXIS), AXIS[:, None]),
    "Prismatic": (mbs.Prismatic(AXIS), np.eye(3)),
    "Cylindrical": (mbs.Cylindrical(AXIS), AXIS[:, None]),
    "Screw": (mbs.Screw(AXIS, pitch=0.1), AXIS[:, None]),
    "Universal": (mbs.Universal(), np.zeros((3, 1))),
    "Spherical": (mbs.Spherical(), np.zeros((3, 1))),
    "Planar": (mbs.Planar(AXIS), np.eye(3)),
    "Weld": (mbs.joints.Weld(), np.eye(3)),
}
LEAST = 1e-12


def pose(random):
    return mbs.Pose(random.normal(size=3), Rotation.random(random_state=random.integers(2**31)).as_matrix())


def shifted(frame, shift):
    return mbs.Pose(frame.position + frame.rotation @ shift, frame.rotation)


def doors(kind, random, like=None, number=1, far=1.0, solver="auto"):
    """Doors, each on two joints of one kind in line, on trolleys that ride on one another."""
    b, (joint, along) = mbs.SystemBuilder(), PAIRS[kind]
    for k in range(number):
        b.body(f"trolley {k}", 2.0, inertia=(0.1, 0.1, 0.1))
        ground = f"trolley {k - 1}" if k else "ground"
        b.joint(
            f"rail {k}", mbs.Prismatic(random.normal(size=3)), ground, f"trolley {k}", far * random.normal(size=3)
        )
        b.body(f"door {k}", 1.0, (0.4, 0.0, 0.3), (0.1, 0.1, 0.1))
        parent, child, shift = pose(random), pose(random), along @ random.normal(size=along.shape[1])
        for name, way in (("low", 0.0), ("high", 1.0)):
            frames = shifted(parent, way * shift), shifted(child, way * shift)
            b.joint(f"{name} {k}", joint, f"trolley {k}", f"door {k}", *frames)
    options = {} if like is not None else {"cut": [f"high {k}" for k in range(number)], "linear_solver": solver}
    return b.build(like=like, **options)


def some_values(system, random):
    """Coordinates of all joints of the tree."""
    found = {}
    for joint in system.topology.joints:
        number = joint.num_coordinates
        value = random.normal(size=number)
        value = value / np.linalg.norm(value) if number == 4 else value
        if number:
            found[joint.name] = value if number > 1 else value[0]
    return found


def change(system, state, values):
    found = system.coordinates(state)
    return max(np.max(np.abs(np.asarray(found[name]) - value)) for name, value in values.items())


def test_every_joint_with_rows_has_a_pair():
    assert {kind.__name__ for kind in ALL if kind.row_units} == set(PAIRS)


def largest_changes(kind, number, seed=7):
    """Largest changes of closed poses by `State.at`, as a guess and half given, and within jit and vmap."""
    random = np.random.default_rng(seed)
    base, found, every = doors(kind, random), [], []
    for _ in range(number):
        system = doors(kind, random, like=base)
        values = some_values(system, random)
        name = list(values)[-1]
        given, guess = {name: values[name]}, {k: v for k, v in values.items() if k != name}
        state = mbs.State.at(system, guess=values)
        half = mbs.State.at(system, given, guess=guess)
        found += [change(system, state, values), change(system, half, values)]
        every.append((system, jax.tree.map(jnp.asarray, values), state.coordinates))
    systems, values, eager = jax.tree.map(lambda *x: jnp.stack(x), *every)
    at = jax.jit(jax.vmap(lambda system, values: mbs.State.at(system, guess=values).coordinates))
    return max(found), np.max(np.abs(at(systems, values) - eager))


@pytest.mark.slow
def test_closed_poses_are_kept():
    assert max(largest_changes("Revolute", 12)) <= LEAST


@pytest.mark.long
@pytest.mark.parametrize("kind", PAIRS)
def test_many_closed_poses_are_kept(kind):
    assert max(largest_changes(kind, 300)) <= LEAST


@pytest.mark.long
@pytest.mark.parametrize("kind", ["Revolute", "Cylindrical", "Planar", "Spherical"])
@pytest.mark.parametrize("solver", ["dense", "frontal", "multifrontal"])
def test_closed_poses_are_kept_by_every_solver_and_far_from_the_origin(kind, solver):
    random = np.random.default_rng(5)
    base = doors(kind, random, number=3, solver=solver)
    for far in (1.0, 1e3, 1e5):
        system = doors(kind, random, like=base, number=3, far=far)
        values = some_values(system, random)
        assert change(system, mbs.State.at(system, guess=values), values) <= LEAST
        traced = jax.jit(lambda system, values: mbs.State.at(system, guess=values))(system, values)
        assert change(system, traced, values) <= LEAST


@pytest.mark.slow
def test_the_branch_of_a_state_is_followed_to_what_is_given():
    random = np.random.default_rng(2)
    system = doors("Revolute", random)
    start = mbs.State.at(system, guess={"low 0": 0.4, "rail 0": 0.2})
    for name, value in (("low 0", 0.9), ("high 0", 0.7)):
        near = mbs.State.at(system, {name: value}, near=start)
        assert change(system, near, {"low 0": value, "rail 0": 0.2}) <= 1e-9
    given = mbs.State.at(system, {"high 0": 0.4}, guess={"low 0": 0.4, "rail 0": 0.2})
    assert change(system, given, {"low 0": 0.4, "rail 0": 0.2}) <= LEAST


def test_velocities_that_keep_the_rows_are_kept():
    random = np.random.default_rng(3)
    system = doors("Revolute", random)
    for at in (mbs.State.at, jax.jit(mbs.State.at)):
        state = at(system, {"low 0": 0.4}, {"low 0": 0.7, "rail 0": 0.3})
        np.testing.assert_allclose([system.velocities(state)[n] for n in ("low 0", "rail 0")], [0.7, 0.3], atol=LEAST)


@pytest.mark.long
@pytest.mark.parametrize("kind", PAIRS)
@pytest.mark.parametrize("solver", ["frontal", "multifrontal"])
def test_rows_of_rounding_hold_nothing_in_any_solver(kind, solver):
    """Accelerations of doors, and what the projection of motions makes of closed states, beside the dense solver."""
    found = []
    for each in ("dense", solver):
        system = doors(kind, np.random.default_rng(3), number=3, solver=each)
        values = some_values(system, np.random.default_rng(4))
        u = np.random.default_rng(1).normal(size=system.topology.num_velocities)
        state = dataclasses.replace(mbs.State.at(system, guess=values), velocities=jnp.asarray(u))
        field = mbs.vector_field(system)
        projected = field.state(0.0, field.project(0.0, field.start(state)))
        np.testing.assert_allclose(projected.coordinates, state.coordinates, atol=LEAST)
        np.testing.assert_allclose(projected.velocities, u, atol=1e-11)
        found.append(np.asarray(mbs.forward_dynamics(system, state)[0]))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-10, atol=1e-10 * np.abs(found[0]).max())


def doubled_four_bar(random, like=None):
    """The four-bar of `tests.models`, each pin twice in line."""
    b, pin = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0)), mbs.Revolute("z")
    for name, length in (("crank", 0.3), ("coupler", 0.9), ("rocker", 0.7)):
        b.body(name, length, (length / 2, 0.0, 0.0), mbs.inertia.rod(length, length))
    for name, parent, child, x, y in (
        ("A", "ground", "crank", 0.0, 0.0),
        ("B", "crank", "coupler", 0.3, 0.0),
        ("D", "ground", "rocker", 1.0, 0.0),
        ("C", "coupler", "rocker", 0.9, 0.7),
    ):
        z = random.normal(size=2)
        for k in range(2):
            b.joint(f"{name}{k}", pin, parent, child, (x, 0.0, z[k]), (y, 0.0, z[k]))
    return b.build(like=like, **({} if like is not None else {"cut": ["A1", "B1", "D1", "C0", "C1"]}))


@pytest.mark.long
def test_doubled_pins_of_a_four_bar_keep_the_closed_form():
    random = np.random.default_rng(0)
    base = doubled_four_bar(random)
    traced = jax.jit(lambda system, values: mbs.State.at(system, guess=values))
    for _ in range(40):
        system, angle = doubled_four_bar(random, like=base), random.uniform(-np.pi, np.pi)
        values = dict(zip(("A0", "B0", "D0"), four_bar_angles(angle), strict=True))
        found = mbs.State.at(system, guess=values), traced(system, jax.tree.map(jnp.asarray, values))
        given = mbs.State.at(system, A0=angle, guess={k: values[k] for k in ("B0", "D0")})
        for state in (*found, given, mbs.State.at(system, A0=angle, near=given)):
            assert change(system, state, values) <= LEAST
