"""Freedoms of classic mechanisms, redundancy by name, and what `describe` says."""

import numpy as np
import pytest

import jaxmbs as mbs
from tests.models import DOWN_Y, PIN, bennett, closed_chain, four_bar, rotation_about


def test_planar_four_bar():
    top = four_bar().topology
    assert (top.mobility, top.num_rows, top.analysis.redundant) == (1, 5, 3)
    assert top.cut_joints == ("C",)
    assert set(top.analysis.redundant_names) == {"A", "B", "C", "D"}
    # Force across the plane and moments in it cannot be told; force in the plane can; a pin takes no moment z.
    for marks in top.analysis.undetermined:
        assert marks == (False, False, True, True, True, False)


def test_bennett_moves_only_with_the_right_twists():
    assert bennett().build().topology.mobility == 1
    try:
        wrong = bennett(beta=0.3).build().topology.mobility
    except mbs.ModelError as error:
        assert "cannot be closed" in str(error)
    else:
        assert wrong == 0


def test_spherical_four_bar():
    """Axes through one point: mobility 1 with three redundant rows, though Gruebler counts -2."""
    top = closed_chain([(0.0, 1.2), (0.0, 0.6), (0.0, 1.1), (0.0, 1.3)])
    system = top.build()
    assert system.topology.mobility == 1
    assert system.topology.analysis.redundant == 3


def test_bricard_line_symmetric():
    """Six equal links of length 1 and twist a right angle with alternating sign."""
    chain = [(1.0, np.pi / 2 * (-1) ** k) for k in range(6)]
    top = closed_chain(chain).build().topology
    assert top.mobility == 1
    assert top.analysis.redundant == 1


@pytest.mark.slow
def test_general_six_bar_loop_is_locked_and_seven_moves():
    angles = (0.9, -0.7, 1.2, 0.8, -1.1, 0.6, 0.7)
    lengths = (1.0, 0.8, 1.1, 0.9, 0.7, 1.2, 1.0)
    chain = list(zip(lengths, angles, strict=True))
    assert closed_chain(chain).build().topology.mobility == 1
    assert closed_chain(chain).build().topology.analysis.redundant == 0


def stewart():
    """Six legs of universal, prismatic and spherical joints."""
    b = mbs.SystemBuilder()
    b.body("platform", mass=5.0, inertia=(0.2, 0.2, 0.4))
    angle = np.radians([10.0, 110.0, 130.0, 230.0, 250.0, 350.0])
    foot = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    head = 0.6 * np.stack([np.cos(angle + 0.4), np.sin(angle + 0.4), 0 * angle], axis=1)
    for k in range(6):
        b.body(f"lower_{k}", mass=0.5, com=(0.0, 0.0, 0.2), inertia=(0.01, 0.01, 0.001))
        b.body(f"upper_{k}", mass=0.5, com=(0.0, 0.0, -0.2), inertia=(0.01, 0.01, 0.001))
        b.joint(f"foot_{k}", mbs.Universal(), "ground", f"lower_{k}", parent_frame=tuple(foot[k]))
        b.joint(f"leg_{k}", mbs.Prismatic(axis="z"), f"lower_{k}", f"upper_{k}", parent_frame=(0.0, 0.0, 1.0))
    for k in range(6):
        b.joint(f"head_{k}", mbs.Spherical(), f"upper_{k}", "platform", child_frame=tuple(head[k]))
    return b


@pytest.mark.slow
def test_stewart_platform():
    top = stewart().build().topology
    assert top.mobility == 6
    assert top.analysis.redundant == 0
    assert len(top.cut_joints) == 5


def parallelogram(rockers=2):
    """Equal cranks under one coupler; a third crank is redundant but lets it move."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    b.body("coupler", mass=1.0, com=(0.5, 0.0, 0.0), inertia=(0.01, 0.1, 0.1), position=(0.0, 1.0, 0.0))
    for k in range(rockers):
        x = k / (rockers - 1)
        b.body(f"crank_{k}", mass=1.0, com=(0.0, 0.5, 0.0), inertia=(0.1, 0.01, 0.1), position=(x, 0.0, 0.0))
    for k in range(rockers):
        x = k / (rockers - 1)
        b.joint(f"foot_{k}", PIN, "ground", f"crank_{k}", at=(x, 0.0, 0.0))
        b.joint(f"head_{k}", PIN, f"crank_{k}", "coupler", at=(x, 1.0, 0.0))
    return b.build()


@pytest.mark.slow
def test_parallelogram_with_an_extra_rocker_moves():
    assert parallelogram(2).topology.mobility == 1
    top = parallelogram(3).topology
    assert top.mobility == 1
    assert top.analysis.redundant == 10 - (top.num_velocities - 1)
    # In the plane too: the two rows of the extra crank repeat one, so forces along the coupler are undetermined.
    marks = dict(zip(top.joint_names, top.analysis.undetermined, strict=True))
    assert marks["head_1"][0] or marks["head_1"][1]


def test_two_balls_on_one_axis():
    """A bar away from the first body: they share the force along their axis, and neither takes a moment."""
    b = mbs.SystemBuilder()
    b.body("sledge", mass=1.0, inertia=0.1)
    b.joint("slide", mbs.Prismatic("x"), "ground", "sledge")
    b.body("bar", mass=1.0, inertia=0.1)
    for name, z in (("low", -0.5), ("high", 0.5)):
        b.joint(name, mbs.Spherical(), "ground", "bar", parent_frame=(1.0, 2.0, z), child_frame=(0.0, 0.0, z))
    top = b.build().topology
    assert (top.mobility, top.analysis.redundant) == (2, 1)
    marks = dict(zip(top.joint_names, top.analysis.undetermined, strict=True))
    assert marks["low"] == marks["high"] == (False, False, True, False, False, False)


def test_a_truss_is_locked():
    """Two bars pinned to the ground and to each other."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    b.body("left", mass=1.0, com=(0.5, 0.0, 0.0), inertia=(0.0, 0.1, 0.1))
    b.body("right", mass=1.0, com=(0.5, 0.0, 0.0), inertia=(0.0, 0.1, 0.1))
    b.joint("A", PIN, "ground", "left")
    b.joint("B", PIN, "ground", "right", parent_frame=(1.2, 0.0, 0.0))
    b.joint("C", PIN, "left", "right", parent_frame=(1.0, 0.0, 0.0), child_frame=(1.0, 0.0, 0.0))
    system = b.build()
    assert system.topology.mobility == 0
    state = mbs.State.at(system, guess={"A": 1.0, "B": 2.1})
    apex = mbs.position(system, state, ("left", (1.0, 0.0, 0.0)))
    np.testing.assert_allclose(apex, [0.6, 0.8, 0.0], atol=1e-10)


def test_describe_names_loops_and_redundancy():
    text = four_bar().describe()
    assert "mobility: 1 (tree velocities 3)" in text
    assert "redundant constraints: 3" in text
    assert "3 bodies, 4 joints, 1 loops, 5 constraint rows" in text
    row = next(line for line in text.splitlines() if line.startswith("C "))
    assert "closes a loop" in row and "coupler -> rocker" in row and "force z, moment x, moment y" in row
    html = four_bar()._repr_html_()
    assert html.count("<tr>") == 5 and "&gt;" in html


def test_a_tree_describes_its_coordinates():
    b = mbs.SystemBuilder()
    b.body("ball", mass=1.0, inertia=np.ones(3))
    b.joint("floats", mbs.Free(), "ground", "ball")
    text = b.build().describe()
    assert "mobility: 6" in text and "qw, qx, qy, qz" in text and "redundant" not in text


@pytest.mark.slow
def test_drives_and_couplers_take_freedoms():
    assert four_bar(drive=lambda t: 0.7 + t).topology.mobility == 0
    b = mbs.SystemBuilder()
    for name in ("one", "two"):
        b.body(name, mass=1.0, inertia=np.ones(3))
        b.joint(f"{name}_pin", mbs.Revolute(axis="x"), "ground", name)
    b.constraint("gear", mbs.Coupler({"one_pin": 1.0, "two_pin": 2.0}))
    assert b.build().topology.mobility == 1


def test_the_axes_of_a_rotated_joint_frame_mark_its_own_components():
    """The same four-bar with joint frames turned so that the pins are their x axes."""
    turn = rotation_about((0, 1, 0), -np.pi / 2)  # x of the joint along z of the body
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    lengths = {"crank": 0.3, "coupler": 0.9, "rocker": 0.7}
    for name, length in lengths.items():
        b.body(name, mass=1.0, com=(length / 2, 0.0, 0.0), inertia=(0.01, 0.1, 0.1))
    at = lambda x: mbs.Pose((x, 0.0, 0.0), np.abs(turn).astype(float) * np.sign(turn))
    pin = mbs.Revolute(axis="x")
    b.joint("A", pin, "ground", "crank", parent_frame=at(0.0), child_frame=at(0.0))
    b.joint("B", pin, "crank", "coupler", parent_frame=at(0.3), child_frame=at(0.0))
    b.joint("D", pin, "ground", "rocker", parent_frame=at(1.0), child_frame=at(0.0))
    b.joint("C", pin, "coupler", "rocker", parent_frame=at(0.9), child_frame=at(0.7))
    top = b.build().topology
    assert top.mobility == 1
    for marks in top.analysis.undetermined:
        assert marks == (True, False, False, False, True, True)


@pytest.mark.parametrize("independent, column", [("A", 0), ("D", 2)])
def test_the_independent_set_of_the_user(independent, column):
    system = _four_bar_builder().build(independent=[independent])
    assert system.topology.analysis.independent == (column,)


@pytest.mark.parametrize("independent", [["A", "D"], []])
def test_a_set_that_does_not_determine_the_motion_is_refused(independent):
    with pytest.raises(mbs.ModelError, match="the mobility is 1"):
        _four_bar_builder().build(independent=independent)


def _four_bar_builder():
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    for name, length in {"crank": 0.3, "coupler": 0.9, "rocker": 0.7}.items():
        b.body(name, mass=1.0, com=(length / 2, 0.0, 0.0), inertia=(0.01, 0.1, 0.1))
    b.joint("A", PIN, "ground", "crank")
    b.joint("B", PIN, "crank", "coupler", parent_frame=(0.3, 0.0, 0.0))
    b.joint("D", PIN, "ground", "rocker", parent_frame=(1.0, 0.0, 0.0))
    b.joint("C", PIN, "coupler", "rocker", parent_frame=(0.9, 0.0, 0.0), child_frame=(0.7, 0.0, 0.0))
    return b
