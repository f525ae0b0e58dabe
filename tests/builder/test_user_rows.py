"""Functions of the user for constraint rows: taken as they are, or refused in words that name the row."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs


def two_bodies(law):
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    for name in ("a", "c"):
        b.body(name, mass=1.0, inertia=0.1)
        b.joint(name, mbs.Planar("z"), "ground", name)
    b.constraint("rule", law)
    return b.build()


NOT_AFFINE = {
    "a product of speeds": lambda q, u, t: jnp.array([u[0] * u[3] + u[1] * u[4]]),
    "a square": lambda q, u, t: u[:1] ** 2 - 1.0,
    "a size": lambda q, u, t: jnp.abs(u[:1]) - 0.5,
    "a limit": lambda q, u, t: jnp.maximum(u[:1], 0.3),
    "of two the second": lambda q, u, t: jnp.array([u[0], jnp.sin(u[1])]),
}
AFFINE = {
    "Pfaffian": lambda q, u, t: jnp.array([u[0] * jnp.sin(q[2]) - u[1] * jnp.cos(q[2])]),
    "driven": lambda q, u, t: jnp.array([(1.0 + t) * u[2] - jnp.cos(t) * q[0] ** 2]),
}
NO_ROWS = {
    "whole numbers": (mbs.joints.PositionRows(lambda q, t: jnp.array([1, 2])), "real numbers.*int"),
    "complex": (mbs.joints.PositionRows(lambda q, t: jnp.asarray(q[:1], complex)), "real numbers.*complex"),
    "nothing": (mbs.joints.PositionRows(lambda q, t: None), "real numbers.*NoneType"),
    "a list": (mbs.joints.VelocityRows(lambda q, u, t: [u[0]]), "real numbers.*list"),
    "a matrix": (mbs.joints.PositionRows(lambda q, t: jnp.outer(q, q)), r"not \(6, 6\)"),
    "an empty array": (mbs.joints.VelocityRows(lambda q, u, t: u[:0]), r"not \(0,\)"),
    "an error of its own": (mbs.joints.PositionRows(lambda q, t: q[0] + q["x"]), "cannot be evaluated: TypeError"),
    "fewer arguments": (mbs.joints.VelocityRows(lambda q, u: u[:1]), "cannot be evaluated: TypeError"),
    "no velocity": (mbs.joints.VelocityRows(lambda q, u, t: q[:1]), "no slope by the velocities"),
    "no coordinate": (
        mbs.joints.PositionRows(lambda q, t: jnp.array([t, q[0]])),
        "row 0 .* no slope by the coordinates",
    ),
}


@pytest.mark.parametrize("name", NOT_AFFINE)
def test_velocity_rows_that_are_not_affine_are_refused(name):
    with pytest.raises(mbs.ModelError, match="'rule'.*not affine in the velocities"):
        two_bodies(mbs.joints.VelocityRows(NOT_AFFINE[name]))


@pytest.mark.parametrize("name", NO_ROWS)
def test_functions_that_give_no_rows_are_refused(name):
    law, words = NO_ROWS[name]
    with pytest.raises(mbs.ModelError, match=f"'rule'.*{words}"):
        two_bodies(law)


def test_the_second_row_is_named():
    with pytest.raises(mbs.ModelError, match="row 1 of its VelocityRows"):
        two_bodies(mbs.joints.VelocityRows(NOT_AFFINE["of two the second"]))


@pytest.mark.parametrize("name", AFFINE)
def test_affine_rows_are_kept(name):
    system = two_bodies(mbs.joints.VelocityRows(AFFINE[name]))
    state = mbs.State.at(system, {"a": (0.7, 0.2, 0.4)}, velocities={"c": (0.3, 0.0, 0.0)}, t=0.2)
    rule = AFFINE[name](state.coordinates, state.velocities, state.t)
    np.testing.assert_allclose(rule, 0.0, atol=1e-9)


def test_a_coupler_of_several_numbers_is_refused():
    b = mbs.SystemBuilder()
    for name in ("a", "c"):
        b.body(name, mass=1.0, inertia=0.1)
        b.joint(name, mbs.Revolute("z"), "ground", name)
    b.constraint("cam", mbs.Coupler({"a": 1.0, "c": 1.0}, function=lambda p, q: jnp.stack([p, q])))
    with pytest.raises(mbs.ModelError, match="'cam'.*must return one number"):
        b.build()
