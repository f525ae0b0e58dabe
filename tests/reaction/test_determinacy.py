"""Marks of loads at the pose asked, in every frame and on both sides: the null space of A^T by singular values."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

import jaxmbs as mbs
from jaxmbs.constraints import _reaction_map as reaction_map
from jaxmbs.kinematics._configuration import at_state
from tests.models import DOWN_Y, PIN, bennett, four_bar

Y = mbs.Revolute("y")


def on_a_turntable():
    """A four-bar in the plane y = 0 of a table that turns about z, tilted joints and a load across its plane."""
    b = mbs.SystemBuilder()
    b.body("table", 5.0, inertia=(1.0, 1.0, 1.0))
    b.joint("turn", mbs.Revolute("z"), "ground", "table")
    for name, length in (("crank", 0.3), ("coupler", 0.9), ("rocker", 0.7)):
        b.body(name, length, (length / 2, 0, 0), mbs.inertia.rod(length, length))
    b.joint("A", Y, "table", "crank")
    b.joint("B", Y, "crank", "coupler", parent_frame=(0.3, 0, 0))
    b.joint("D", Y, "table", "rocker", parent_frame=(1.0, 0, 0))
    b.joint("C", Y, "coupler", "rocker", parent_frame=(0.9, 0, 0), child_frame=(0.7, 0, 0))
    b.force("push", mbs.Force((0, 50.0, 0), axes="body"), on="coupler")
    system = b.build()
    return system, [mbs.State.at(system, turn=q, A=0.7, guess={"B": -0.4, "D": 1.4}) for q in (0.0, 0.4, np.pi / 2)]


def slide_with_a_strut():
    """A driven slider-crank whose slide runs on two rails, with a rod to the ground in their plane."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    b.body("crank", 1.0, (0.1, 0, 0), mbs.inertia.rod(1.0, 0.2))
    b.body("rod", 1.5, (0.3, 0, 0), mbs.inertia.rod(1.5, 0.6))
    b.body("slide", 2.0, inertia=(0.01,) * 3)
    b.joint("main", PIN, "ground", "crank", drive=mbs.Ramp(0.6, 2.0))
    b.joint("pin", mbs.Spherical(), "crank", "rod", parent_frame=(0.2, 0, 0))
    b.joint("wrist", mbs.Universal(("z", "y")), "rod", "slide", parent_frame=(0.6, 0, 0))
    for k, z in enumerate((-0.1, 0.1)):
        b.joint(f"rail{k}", mbs.Prismatic("x"), "ground", "slide", parent_frame=(0, 0, z), child_frame=(0, 0, z))
    system = b.build()
    return system, [mbs.State.at(system, t=t, guess={"rail0": 0.7}) for t in (0.0, 0.3)]


def on_four_feet():
    """A table on four feet and a pin about the vertical through one of them."""
    b = mbs.SystemBuilder()
    b.body("table", 10.0, (0.3, 0.1, 0.3), (1.0, 1.0, 1.0))
    b.joint("floats", mbs.Free(), "ground", "table")
    for k, (x, y) in enumerate([(1.0, 0.5), (1.0, -0.5), (-1.0, 0.5), (-1.0, -0.5)]):
        b.constraint(f"foot_{k}", mbs.joints.PointOnPlane(), between=("ground", ("table", (x, y, 0.0))))
    b.constraint("stop", mbs.joints.PointOnLine(), between=("ground", "table"))
    system = b.build()
    turned = np.array([0.0, 0.0, 0.0, np.cos(0.3), 0.0, 0.0, np.sin(0.3)])
    return system, [mbs.State.at(system), mbs.State.at(system, guess={"floats": turned})]


def loop_of_bennett():
    """Mobile by its dimensions alone: every component of it, in skew axes."""
    system = bennett().build()
    first = system.topology.structure[0][0]
    return system, [mbs.State.at(system, {first: 0.4})]


def at_a_dead_centre():
    """A parallelogram in line and beside it: in line one more load is open, that along the bars."""
    system = four_bar((1.0, 0.4, 1.0, 0.4))
    return system, [mbs.State.at(system, A=q, guess={"B": -q, "D": q}) for q in (0.0, 1e-3, 0.5)]


MECHANISMS = {
    "turntable": (on_a_turntable, "world", "child"),
    "strut": (slide_with_a_strut, "world", "parent"),
    "feet": (on_four_feet, "joint", "parent"),
    "Bennett": (loop_of_bennett, "joint", "child"),
    "dead centre": (at_a_dead_centre, "world", "child"),
}


@jax.jit
def rows_and_frames(system, state):
    """A (rows, nv), reactions (carriers, 6, rows) in joint axes on the children, rotations and places of frames."""
    at = at_state(system, state)
    return mbs.constraints.constraint_jacobian(system, state), reaction_map.reaction_map(system, at), at.R, at.x


def open_by_singular_values(system, state, frame, side):
    """Components (carriers, 6) of force and moment that some null vector of A^T has."""
    A, W, R, x = map(np.asarray, rows_and_frames(system, state))
    stress = W @ scipy.linalg.null_space(A.T, rcond=1e-7)
    parent, child = np.array([pair for _, *pair in reaction_map.reaction_carriers(system)]).T
    force, moment = (np.einsum("cij,cjk->cik", R[child], part) for part in (stress[:, :3], stress[:, 3:]))
    if side == "parent":
        moment = moment + np.cross((x[child] - x[parent])[:, :, None], force, axis=1)
    if frame == "joint":
        own = R[child if side == "child" else parent]
        force, moment = (np.einsum("cji,cjk->cik", own, part) for part in (force, moment))
    size = np.abs(np.concatenate([force, moment / float(system.length)], axis=1)).max(axis=2, initial=0.0)
    return size > 1e-6 * max(size.max(), 1e-3)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:state. the mechanism has mobility")
@pytest.mark.parametrize("name", MECHANISMS)
def test_marks_are_those_of_the_null_space(name):
    build, frame, side = MECHANISMS[name]
    system, states = build()
    together = jax.tree.map(lambda *x: jnp.stack(x), *states)
    loads = mbs.reactions(system, together, frame=frame, side=side)
    assert np.all(loads.ok) and (loads.frame, loads.side) == (frame, side)
    names, seen = [name for name, *_ in reaction_map.reaction_carriers(system)], []
    for k, state in enumerate(states):
        expected = ~open_by_singular_values(system, state, frame, side)
        found = [np.r_[loads[n].unique_force[k], loads[n].unique_moment[k]] for n in names]
        np.testing.assert_array_equal(found, expected, err_msg=f"{names} at state {k}")
        seen.append(expected)
    assert not np.all(seen)  # something is open in each of them
    if len(states) > 1 and name != "feet":
        assert name == "strut" or np.any(seen[0] != seen[-1])  # and belongs to a pose


@pytest.mark.long
def test_what_is_unique_does_not_move_with_the_compliances():
    system, states = on_a_turntable()
    plain, soft = (
        mbs.reactions(system, states[-1], compliance={"D": (1.0, s, 1.0, 1.0, 1.0, 1.0)}) for s in (1.0, 30.0)
    )
    for name, load in plain.items():
        moved = np.abs(np.asarray(soft[name].force) - np.asarray(load.force)) > 1e-6
        assert not np.any(moved & np.asarray(load.unique_force))
    assert abs(soft["C"].force[0] - plain["C"].force[0]) > 1.0 and not plain["C"].unique_force[0]
