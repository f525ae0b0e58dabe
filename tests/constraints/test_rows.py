"""Rows of every kind: slopes and rates against differences, and many elements of a group as one by one.

What a kind of row says of itself, beside its value, is true.
"""

import functools
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.constraints import _constraints as constraints
from jaxmbs.constraints import _rows as rows
from jaxmbs.constraints._saddle_operator import constraint_operator
from jaxmbs.forces import Attachment, Sheave
from jaxmbs.joints import AbstractRows, PositionRows, VelocityRows
from jaxmbs.kinematics._configuration import at_state, node_accelerations, with_velocities
from jaxmbs.kinematics._poses import neutral_coordinates, step_coordinates
from jaxmbs.kinematics._tree import subtrees
from jaxmbs.kinematics._wrench_targets import node_targets
from jaxmbs.model._rows import row_elements

_STEP = 1e-5


class Guide(AbstractRows):
    """The height of frame B over frame A follows the distance beside it and a joint, in time: no slopes given."""

    num_frames = 2

    joints: tuple[str, ...] = eqx.field(static=True)
    curvature: jax.Array

    def is_length(self, kinds):
        return True

    def value(self, rotations, positions, q, t):
        x, y, z = rotations[0].T @ (positions[1] - positions[0])
        tilt = (rotations[0].T @ rotations[1])[2, 0]
        return jnp.stack([y - self.curvature * x**2 + 0.1 * jnp.sin(q[0] + t), z + 0.2 * tilt])


def _arms(number, declare, drive=None):
    """A free body and three turning ones beside each other, `number` times, with the rows that `declare` adds."""
    b = mbs.SystemBuilder(gravity=(0.3, -9.81, 0.5))
    for k in range(number):
        size = 1.0 + 0.1 * k
        b.body(f"free{k}", size, com=(0.1, 0, 0), inertia=(0.1, 0.2, 0.3))
        b.joint(f"loose{k}", mbs.Free(), "ground", f"free{k}")
        for name, parent in (("one", "ground"), ("two", f"one{k}"), ("three", "ground")):
            b.body(f"{name}{k}", size, com=(0.2, 0.1, 0), inertia=(0.1, 0.1, 0.2))
            held = drive(k) if drive and name == "one" else None
            b.joint(f"{name}{k}", mbs.Revolute("z"), parent, f"{name}{k}", parent_frame=(0.4, 0, 0.1 * k), drive=held)
        declare(b, k)
    return b.build()


def _cable(b, k):
    path = [Attachment((f"two{k}", (0.3, 0, 0))), Sheave(("ground", (0, 1.0, 0.1)), 0.1), Attachment(f"free{k}")]
    b.cable(f"row{k}", path, free_length=lambda t: 2.0 + 0.1 * jnp.sin(t), inextensible=True)


def _none(b, k):
    pass


KINDS = {  # rows, drives; number of elements that a group has
    "drive": (_none, lambda k: mbs.Harmonic(amplitude=0.3 + 0.1 * k, omega=2.0), 3),
    "coupler": (
        lambda b, k: b.constraint(f"row{k}", mbs.Coupler({f"one{k}": 1.0 + k, f"two{k}": -2.0}, 0.1)),
        None,
        3,
    ),
    "function of joints": (
        lambda b, k: b.constraint(f"row{k}", mbs.Coupler({f"one{k}": 1.0, f"three{k}": 1.0}, 0.1 * k, _cam)),
        None,
        3,
    ),
    "cable": (_cable, None, 3),
    "of a user, on frames and a joint": (
        lambda b, k: b.constraint(f"row{k}", Guide((f"one{k}",), jnp.asarray(0.4)), (f"three{k}", f"free{k}")),
        None,
        1,  # the joints are static
    ),
    "position": (lambda b, k: b.constraint(f"row{k}", PositionRows(_position)), None, 1),
    "velocity": (lambda b, k: b.constraint(f"row{k}", VelocityRows(_velocity)), None, 1),
}


def _cam(first, second):
    return jnp.sin(first) + 0.5 * second**2


def _position(q, t):
    return jnp.stack([q[0] * q[7] + jnp.sin(t) * q[3], jnp.sum(q[3:7] * q[:4])])


def _velocity(q, u, t):
    return jnp.sin(q[1]) * u[0] + q[4] * u[4] + q[7] * u[6] + jnp.cos(t)


@functools.cache
def _case(kind, number=1):
    declare, drive, _ = KINDS[kind]
    return _arms(number, declare, drive)


class _Pose(NamedTuple):
    """Coordinates that need not keep the rows, in place of a state."""

    coordinates: jax.Array
    t: jax.Array
    internal: None = None


def _random_pose(system):
    top, random = system.topology, np.random.default_rng(5)
    rest = jnp.asarray(neutral_coordinates(top), float)
    return step_coordinates(top, rest, jnp.asarray(0.3 * random.normal(size=top.num_velocities)))


@mbs.jit(compile="tape")
def _evaluated(system, psi, u, t):
    """Residual f, rows A, rates f_t at rest, and `A_dot u + d f_t / dt` at constant velocities."""
    at = with_velocities(system, at_state(system, _Pose(psi, t)), u)
    bias = constraints.acceleration_bias(system, at, node_accelerations(system.topology, at, jnp.zeros_like(u)))
    return (
        constraints.residual(system, at),
        constraints.jacobian(system, at),
        constraints.time_rate(system, at),
        -bias,
    )


@pytest.mark.parametrize("kind", KINDS)
def test_slopes_and_rates_are_those_of_differences(kind):
    system = _case(kind)
    psi, u, t = _random_pose(system), jnp.asarray(np.random.default_rng(6).normal(size=9)), jnp.asarray(0.7)
    _, A, f_t, bias = _evaluated(system, psi, u, t)
    before, after = (
        _evaluated(system, step_coordinates(system.topology, psi, step * u), u, t + step) for step in (-_STEP, _STEP)
    )
    speed = lambda found: found[1] @ u + found[2]
    np.testing.assert_allclose(bias, (speed(after) - speed(before)) / (2 * _STEP), rtol=1e-7, atol=1e-7)
    if len(before[0]):
        np.testing.assert_allclose(A @ u + f_t, (after[0] - before[0]) / (2 * _STEP), rtol=1e-7, atol=1e-8)
    assert np.all(np.abs(A).max(axis=1) > 1e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_wrenches_and_efforts_are_the_transposed_rates(kind):
    """Of the operator without a matrix, too."""
    system = _case(kind)
    y = jnp.asarray(np.random.default_rng(7).normal(size=system.topology.num_rows))
    A, unit, rates, efforts, along, inside = _transposed(system, _random_pose(system), y)
    np.testing.assert_allclose(rates, unit * (A @ np.ones(9)), atol=1e-12)
    np.testing.assert_allclose(efforts, (unit * y) @ A, atol=1e-12)
    np.testing.assert_allclose(along + inside, y @ A, atol=1e-12)


@mbs.jit(compile="tape")
def _transposed(system, psi, y):
    """Rows, unit, rates and efforts of the operator, and efforts by wrenches on nodes and inside of joints."""
    at = at_state(system, _Pose(psi, jnp.asarray(0.7)))
    operator, on_nodes = constraint_operator(system, at), rows.wrenches_on(node_targets(system), system, at, y)
    along = jnp.sum(at.S * subtrees(system.topology.nodes, on_nodes), axis=1)
    inside = rows.column_efforts(system, rows.slopes(system, at), y)
    rates = operator.rates(jnp.ones_like(psi, shape=9))
    return constraints.jacobian(system, at), operator.unit, rates, operator.efforts(y), along, inside


@pytest.mark.long
@pytest.mark.parametrize("kind", [kind for kind, (*_, together) in KINDS.items() if together > 1])
def test_many_of_a_kind_are_one_group_and_act_as_one_by_one(kind):
    system = _case(kind, 3)
    assert len(system.rows) == 1 and len(system.rows[0].names) == 3
    declare, drive, _ = KINDS[kind]
    psi, u = _random_pose(system), jnp.asarray(np.random.default_rng(6).normal(size=27))
    every = _evaluated(system, psi, u, jnp.asarray(0.7))
    only = lambda add: lambda *args: add(*args) if args[-1] == 1 else None
    alone = _arms(3, only(declare), drive and only(drive))  # the others of the three have no rows
    for found, own in zip(every, _evaluated(alone, psi, u, jnp.asarray(0.7)), strict=True):
        np.testing.assert_allclose(found[1:2], own, atol=1e-12)


@pytest.mark.slow
def test_rows_keep_the_order_in_which_they_are_declared():
    """Drives first, by joint, then constraints, rows of velocity last, though groups mix them."""

    def declare(b, k):
        b.constraint(f"slip{k}", VelocityRows(_velocity))
        b.constraint(f"gear{k}", mbs.Coupler({f"one{k}": 1.0, f"two{k}": -2.0}))
        b.constraint(f"place{k}", PositionRows(_position))
        _cable(b, k)

    system = _arms(2, declare, KINDS["drive"][1])
    names = [
        "one0",
        "one1",
        "gear0",
        "place0",
        "place0",
        "row0",
        "gear1",
        "place1",
        "place1",
        "row1",
        "slip0",
        "slip1",
    ]
    assert list(system.topology.row_joint) == names
    assert [element.name for element in row_elements(system.rows)] == list(dict.fromkeys(names))
    psi = _random_pose(system)
    A = _evaluated(system, psi, jnp.zeros(18), jnp.asarray(0.7))[1]
    by_name = {name: np.flatnonzero(np.array(names) == name) for name in names}
    for name, column in (("one0", 6), ("one1", 15)):
        assert np.flatnonzero(A[by_name[name][0]]).tolist() == [column]
    assert np.flatnonzero(A[by_name["gear1"][0]]).tolist() == [15, 16]


def test_the_guide_of_a_user_carries_its_load():
    """Its multipliers balance gravity on a bead, and the reaction is found by name."""
    b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
    b.body("wheel", 1.0, inertia=0.1)
    b.joint("turn", mbs.Revolute("z"), "ground", "wheel")
    b.body("bead", 2.0, inertia=0.1)
    b.joint("loose", mbs.Free(), "ground", "bead")
    b.constraint("guide", Guide(("turn",), jnp.asarray(0.4)), ("ground", "bead"))
    system = b.build()
    found = mbs.reactions(system, mbs.State.at(system, turn=0.0))
    assert found.ok
    np.testing.assert_allclose(found.row("guide").multipliers[0], 2.0 * 9.81 / (1.0 + 0.1**2 * 2.0 / 0.1), rtol=1e-9)
    A = mbs.constraints.constraint_jacobian(system, mbs.State.at(system, turn=0.0))
    wanted = system.by_joint(found.row("guide").multipliers @ A)
    assert set(found.row("guide").efforts) == {"turn", "loose"}
    for joint, effort in found.row("guide").efforts.items():
        np.testing.assert_allclose(np.squeeze(effort), wanted[joint], atol=1e-12)


@pytest.mark.parametrize(
    "value, words",
    [
        (lambda R, x, q, t: nonesuch, "cannot be evaluated: NameError"),  # noqa: F821
        (lambda R, x: x[0], "cannot be evaluated"),
        (lambda R, x, q, t: x[1][0], r"must return \(m,\) numbers, not \(\)"),
        (lambda R, x, q, t: x, r"must return \(m,\) numbers, not \(2, 3\)"),
        (lambda R, x, q, t: x[1][:0], r"must return \(m,\) numbers, not \(0,\)"),
        (
            lambda R, x, q, t: x[1] > 0,
            "must return an array of real numbers, zero where the row is kept; it returns bool",
        ),
        (lambda R, x, q, t: "text", "cannot be evaluated"),
    ],
    ids=["unknown name", "arguments", "number", "matrix", "nothing", "truth", "text"],
)
def test_a_law_that_gives_no_rows_is_named(value, words):
    class Mine(AbstractRows):
        num_frames = 2

        def value(self, rotations, positions, q, t):
            return value(rotations, positions, q, t)

    b = mbs.SystemBuilder()
    b.body("bead", 1.0, inertia=0.1)
    b.joint("loose", mbs.Free(), "ground", "bead")
    b.constraint("mine", Mine(), between=("ground", "bead"))
    with pytest.raises(mbs.ModelError, match=rf"constraint 'mine': the function of its Mine {words}"):
        b.build()


def test_a_law_of_velocities_reads_all_of_them():
    class Mine(AbstractRows):
        is_nonholonomic = True

        def slip(self, q, u, t):
            return u[:1]

    b = mbs.SystemBuilder()
    b.body("bead", 1.0, inertia=0.1)
    b.joint("loose", mbs.Free(), "ground", "bead")
    b.constraint("mine", Mine())
    with pytest.raises(mbs.ModelError, match="Mine restricts velocities alone, so it has reads_all"):
        b.build()
