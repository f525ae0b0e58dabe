"""A joint that closes a loop half a turn off is open: its rows do not vanish there, and a build says so."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.joints._base import HALF_TURN_RESIDUAL, alignment_rows, parallel_rows
from tests.models import DOWN_Y, PIN, rotation_about

HALF = np.diag([-1.0, -1.0, 1.0])


@pytest.mark.long
@pytest.mark.parametrize("rows, axis", [(parallel_rows, (1.0, 0.0, 0.0)), (alignment_rows, (0.3, -0.5, 0.7))])
def test_rows_rise_up_to_half_a_turn(rows, axis):
    axis = np.array(axis) / np.linalg.norm(axis)
    angles = np.r_[1e-9, 0.3, 1.5, np.pi / 2, 1.6, 2.5, np.pi - 1e-6, np.pi]
    size = [np.linalg.norm(rows(jnp.asarray(rotation_about(axis, angle)))) for angle in angles]
    near = angles < np.pi / 2
    np.testing.assert_allclose(np.array(size)[near], 2.0 * np.tan(angles[near] / 2.0), rtol=1e-7)
    assert np.all(np.diff(size[:-1]) > 0.0)
    np.testing.assert_allclose(size[-2:], HALF_TURN_RESIDUAL, rtol=1e-6)
    slopes = jax.jacfwd(rows)(jnp.asarray(rotation_about(axis, np.pi)))
    assert np.all(np.isfinite(slopes))


@pytest.mark.long
@pytest.mark.parametrize("rows, axis", [(parallel_rows, (1.0, 0.0, 0.0)), (alignment_rows, (0.0, 0.0, 1.0))])
def test_slopes_where_the_sine_is_zero(rows, axis):
    """An exactly planar loop stands there: 2 tan(angle / 2) has the slopes 1, 0 and 1/2, in either mode."""
    x, y, z = axis
    skew = jnp.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])

    def along(angle):
        R = jnp.eye(3) + jnp.sin(angle) * skew + (1.0 - jnp.cos(angle)) * skew @ skew
        return jnp.sum(rows(R))  # one row is not zero: that of the axis

    slope, other = jax.jacfwd(along), jax.jacfwd(jax.grad(along))
    second = jax.jacfwd(slope)
    orders = (slope, second, jax.jacfwd(second), other, jax.grad(other))
    found = jax.jit(lambda angle: jnp.stack([order(angle) for order in orders]))(0.0)
    np.testing.assert_allclose(found * jnp.sign(found[0]), [1.0, 0.0, 0.5, 0.0, 0.5], atol=1e-12)
    assert np.all(np.isfinite(jax.jit(second)(np.pi)))


def slider(cut=None, frame=HALF):
    """A car on a rail behind a bar; the frame of the rail on the car may be half a turn off."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    for name in ("bar", "car"):
        b.body(name, 1.0, (0.3, 0.0, 0.0), (0.01, 0.1, 0.1))
    b.joint("pin", PIN, "ground", "bar")
    b.joint("pin2", PIN, "bar", "car", parent_frame=(0.5, 0.0, 0.0))
    b.joint("P", mbs.Prismatic("x"), "ground", "car", child_frame=mbs.Pose((0.2, 0.0, 0.0), frame))
    return b.build(cut=cut)


def test_a_prismatic_half_a_turn_off_is_refused_by_name():
    with pytest.raises(mbs.ModelError, match=r"joint 'P': in the reference pose .* half a turn \(180.0000 degrees\)"):
        slider(["P"])
    almost = rotation_about((0.0, 0.0, 1.0), np.pi - 1e-6)
    with pytest.raises(mbs.ModelError, match="joint 'P'"):
        slider(["P"], almost)


@pytest.mark.long
def test_a_slider_crank_has_one_freedom_wherever_it_is_cut():
    def build(cut, turned):
        b = mbs.SystemBuilder(gravity=DOWN_Y)
        b.body("crank", 1.0, (0.1, 0.0, 0.0), (0.01, 0.1, 0.1))
        b.body("rod", 1.0, (0.3, 0.0, 0.0), (0.01, 0.1, 0.1))
        b.body("car", 1.0)
        b.joint("A", PIN, "ground", "crank")
        b.joint("B", PIN, "crank", "rod", parent_frame=(0.2, 0.0, 0.0))
        b.joint("C", PIN, "rod", "car", parent_frame=(0.6, 0.0, 0.0))
        b.joint("slide", mbs.Prismatic("x"), "ground", "car", child_frame=mbs.Pose((0, 0, 0), turned))
        return b.build(cut=[cut])

    for cut in ("A", "B", "C", "slide"):
        assert build(cut, np.eye(3)).topology.mobility == 1
    with pytest.raises(mbs.ModelError, match="joint 'slide'"):
        build("slide", HALF)
    state = mbs.State.at(
        build("C", HALF), A=0.3
    )  # the slide stands in the tree: the car rides turned, no loop is off
    assert state.ok


def test_a_revolute_with_opposed_axes_is_refused():
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    over = mbs.Pose((0.5, 0.0, 0.0), np.diag([1.0, -1.0, -1.0]))
    for name in ("left", "top", "right"):
        b.body(name, 1.0, (0.25, 0.0, 0.0), (0.01, 0.1, 0.1))
    b.joint("A", PIN, "ground", "left")
    b.joint("B", PIN, "left", "top", parent_frame=(0.5, 0.0, 0.0))
    b.joint("D", PIN, "ground", "right", parent_frame=(0.5, 0.0, 0.0))
    b.joint("C", PIN, "top", "right", parent_frame=(0.5, 0.0, 0.0), child_frame=over)
    with pytest.raises(mbs.ModelError, match="joint 'C'"):
        b.build(cut=["C"])


def test_a_nut_half_a_turn_off_is_open():
    screw = mbs.Screw("z", pitch=0.01)
    off = screw.closure(jnp.asarray(rotation_about((0, 0, 1), np.pi)), jnp.zeros(3))
    np.testing.assert_allclose(abs(off[2]), 0.01 * HALF_TURN_RESIDUAL, rtol=1e-6)
