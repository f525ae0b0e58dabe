"""Joints between frames, frames on frames, and links drawn by their points."""

import jax
import numpy as np
import pytest

import jaxmbs as mbs

PIN = mbs.Revolute("z")
TURNED = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
TIP, HEEL = mbs.Pose((1.0, 0.2, 0.0), TURNED), mbs.Pose((0.0, 0.3, 0.1))


def two_bodies(parent, child, **places):
    b = mbs.SystemBuilder()
    b.frame("sole", on="heel", position=(0.0, 0.1, 0.0))  # declared before what carries it
    for name in ("arm", "hand"):
        b.body(name, mass=1.0, com=(0.1, 0, 0), inertia=0.1)
    b.frame("tip", "arm", TIP.position, TIP.rotation)
    b.frame("heel", "hand", (0.0, 0.2, 0.1))
    b.joint("shoulder", PIN, "ground", "arm")
    b.joint("wrist", mbs.Revolute("y"), parent, child, **places)
    return b


FORMS = {
    "names of frames": (("tip", "sole"), {}),
    "points and poses of bodies": ((("arm", TIP), ("hand", (0.0, 0.3, 0.1))), {}),
    "a frame and a body": (("tip", "hand"), {"child_frame": (0.0, 0.3, 0.1)}),
    "the other way about": (("arm", "sole"), {"parent_frame": "tip"}),
}


@pytest.mark.parametrize("form", FORMS)
def test_a_joint_between_frames_is_one_between_their_bodies(form):
    ends, places = FORMS[form]
    wanted = two_bodies("arm", "hand", parent_frame=TIP, child_frame=HEEL).build()
    found = two_bodies(*ends, **places).build()
    assert found.topology == wanted.topology
    for x, y in zip(jax.tree.leaves(found), jax.tree.leaves(wanted), strict=True):
        np.testing.assert_allclose(x, y, atol=1e-15)


@pytest.mark.parametrize(
    ("ends", "places", "words"),
    [
        (("tap", "hand"), {}, ("wrist", "parent", "did you mean 'tip'")),
        (("arm", "tip"), {"parent_frame": "tip"}, ("parent and child are both 'arm'",)),
        (("tip", "hand"), {"parent_frame": (1, 0, 0)}, ("'tip' is a frame", "parent_frame=")),
        ((("arm", (1, 0, 0)), "hand"), {"parent_frame": (1, 0, 0)}, ("places it already", "parent_frame=")),
        ((("arm", (1, 0)), "hand"), {}, ("wrist", "(body, point)")),
        ((("arm", [1.0, 0.0, np.nan]), "hand"), {}, ("wrist", "not finite")),
        ((3, "hand"), {}, ("wrist", "parent", "3 is not a body name, frame name")),
        (("tip", "sole"), {"at": (0, 0, 0)}, ("at= places both",)),
        (("arm", "hand"), {"at": "tap"}, ("'wrist', at", "did you mean 'tip'")),
    ],
)
def test_wrong_ends_are_named(ends, places, words):
    with pytest.raises(mbs.ModelError) as error:
        two_bodies(*ends, **places).build()
    assert all(word in str(error.value) for word in words), str(error.value)


def test_all_faults_of_a_joint_are_in_one_report():
    b = two_bodies("arm", "hand")
    b.joint("bad", mbs.Revolute((0, 0, 0)), "tap", ("arm", (1, 0, 0)), parent_frame="tap", drive=lambda t: (t, t))
    with pytest.raises(mbs.ModelError) as error:
        b.build()
    assert all(word in str(error.value) for word in ("did you mean 'tip'", "no direction", "is not a frame", "drive"))


def test_frames_that_carry_each_other_are_named():
    b = two_bodies("arm", "hand")
    b.frame("one", on="two")
    b.frame("two", on="one")
    with pytest.raises(mbs.ModelError, match="frame 'one': the frames that carry it form a circle"):
        b.build()


def four_bar(knee=(0.35, 0.7), like=None):
    b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
    b.link("crank", O=(0, 0), A=(0.2, 0.2), mass=1.0)
    b.link("coupler", A=(0.2, 0.2), B=knee, mass=2.0)
    b.link("rocker", B=knee, C=(1.0, 0), mass=1.5)
    b.joint("O", PIN, "ground", "crank", at="crank.O")
    b.joint("A", PIN, "crank.A", "coupler.A")
    b.joint("B", PIN, "coupler.B", "rocker.B")
    b.joint("C", PIN, ("ground", (1.0, 0, 0)), "rocker.C")
    return b.build(like=like)


def by_lengths():
    """The same four-bar with frames along its bars, as a table of lengths and angles has it."""
    b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
    bars = {"crank": (0.2 + 0.2j, 1.0), "coupler": (0.15 + 0.5j, 2.0), "rocker": (0.65 - 0.7j, 1.5)}
    for name, (bar, mass) in bars.items():
        b.body(name, mass=mass, com=(abs(bar) / 2, 0, 0), inertia=mbs.inertia.rod(mass, abs(bar)))
    ends = {name: (abs(bar), 0, 0) for name, (bar, _) in bars.items()}
    b.joint("O", PIN, "ground", "crank")
    b.joint("A", PIN, "crank", "coupler", parent_frame=ends["crank"])
    b.joint("B", PIN, "coupler", "rocker", parent_frame=ends["coupler"])
    b.joint("C", PIN, "ground", "rocker", parent_frame=(1.0, 0, 0), child_frame=ends["rocker"])
    angles = np.angle([bar for bar, _ in bars.values()])
    return b.build(), dict(zip("OAB", (angles[0], *np.diff(angles)), strict=True))


@pytest.mark.slow
def test_links_drawn_at_their_places_are_assembled_there():
    drawn = four_bar()
    state = mbs.State.at(drawn, velocities={"O": 2.0})  # no guess
    assert state.ok
    np.testing.assert_allclose(state.coordinates, 0.0, atol=1e-12)
    np.testing.assert_allclose(mbs.position(drawn, state, "rocker.B"), (0.35, 0.7, 0.0), atol=1e-12)
    other, angles = by_lengths()
    there = mbs.State.at(other, O=angles.pop("O"), guess=angles, velocities={"O": 2.0})
    one, two = mbs.reactions(drawn, state), mbs.reactions(other, there)
    for name in "OABC":  # parent and child are the same in both
        np.testing.assert_allclose(one[name].force, two[name].force, atol=1e-8)


@pytest.mark.slow
def test_points_of_a_drawing_have_derivatives():
    first = four_bar()

    @mbs.jit
    def load(x):
        system = four_bar((x, 0.7), like=first)
        return mbs.reactions(system, mbs.State.at(system))["C"].force[1]

    slope, step = mbs.jit(jax.grad(load))(0.35), 1e-5
    np.testing.assert_allclose(slope, (load(0.35 + step) - load(0.35 - step)) / (2 * step), rtol=1e-6)


def test_mass_of_a_link_is_that_of_bars_along_its_outline():
    b = mbs.SystemBuilder()
    b.link("bar", A=(1, 0), B=(1, 2), mass=3.0)
    b.link("square", A=(0, 0), B=(2, 0), C=(2, 2), D=(0, 2), mass=4.0, plane="xz")
    b.link("point", 1.0, points={"1": (3, 4)}, plane="yz")
    b.link("own", A=(0, 0), B=(1, 0, 5), mass=2.0, com=(0.25, 0), inertia=(1.0, 2.0, 3.0))
    bodies, frames = b.declared.bodies, b.declared.frames
    np.testing.assert_allclose(bodies["bar"].com, (1, 1, 0))
    np.testing.assert_allclose(bodies["bar"].inertia, np.diag([1.0, 0.0, 1.0]), atol=1e-12)  # m l^2 / 12
    np.testing.assert_allclose(bodies["square"].com, (1, 0, 1))
    side = 2 * (4 / 12) + 2.0  # about x: two bars turn about their middle, two lie 1 m away
    np.testing.assert_allclose(bodies["square"].inertia, np.diag([side, 2 * side, side]), atol=1e-12)
    np.testing.assert_allclose(bodies["point"].com, (0, 3, 4))
    np.testing.assert_allclose(bodies["own"].com, (0.25, 0, 0))
    assert bodies["own"].inertia == (1.0, 2.0, 3.0)
    np.testing.assert_allclose(frames["own.B"].pose.position, (1, 0, 5))


@pytest.mark.parametrize(
    ("points", "options", "words"),
    [
        ({}, {}, "it has no points"),
        ({"A": (0, 0), "B": (0, 0)}, {}, "'A' and 'B' are at one place"),
        ({"A": (0, 0, 0, 0)}, {}, "A must be two numbers"),
        ({"A": (0, np.inf)}, {}, "A is not finite"),
        ({"A": 3.0}, {}, "A must be two numbers"),
        ({"A": (0, 0)}, {"plane": "zx"}, "plane must be one of"),
        ({"A": (0, 0)}, {"mass": -1.0}, "mass is -1.0"),
        ({"A": (0, 0)}, {"com": (1,)}, "com must be two numbers"),
    ],
)
def test_wrong_points_are_named(points, options, words):
    b = mbs.SystemBuilder()
    b.link("arm", points=points, **options)
    found = "\n".join(b.faults())
    assert "'arm'" in found and words in found


def test_links_and_joints_between_frames_go_through_a_file(tmp_path):
    b = two_bodies("tip", ("hand", HEEL))
    b.link("crank", O=(0, 0), A=(0.2, 0.2), mass=1.0)
    b.joint("O", PIN, "ground", "crank", at="crank.O")
    mbs.save_model(b, tmp_path / "model.json")
    again = mbs.load_model(tmp_path / "model.json").build()
    for x, y in zip(jax.tree.leaves(b.build()), jax.tree.leaves(again), strict=True):
        np.testing.assert_array_equal(x, y)
