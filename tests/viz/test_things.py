"""Things in pictures: cables are as long as they are, on their wheels and tangent to them; gears touch."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.path import Path

import jaxmbs as mbs
from jaxmbs import viz
from jaxmbs.forces import Attachment, BevelGear, Eyelet, Sheave, Winch, WormGear, WrapCylinder, WrapSphere
from jaxmbs.viz._shape_lines import thing_lines
from jaxmbs.viz._things import things
from jaxmbs.viz.scenes._trajectory import frame_trajectory

WRAPS = {
    "sheave": Sheave(("ground", (0, 0, 0)), 0.3, axis="y", side="+"),
    "cylinder": WrapCylinder(("ground", (0, 0, 0)), 0.3, axis="y", side="+"),
    "sphere": WrapSphere(("ground", (0, 0, 0)), 0.3, axis="y", side="+"),
}


def test_drawn_gears_touch():
    """Rims of bevel gears roll on each other where the pitch lines meet; a worm and its wheel are side by side."""
    y = mbs.Pose((0, 0, 0), np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]]))  # z of the frame along x
    b = mbs.SystemBuilder()
    for name, frame in {"A": (0, 0, 0), "B": y}.items():
        b.body(name, 1.0, inertia=1e-2)
        b.joint(name, mbs.Revolute("z"), "ground", name, parent_frame=frame)
    b.force("bevel", BevelGear((20, 30), 4e-3), between=("A", "B"))
    system = b.build()
    (gears,) = thing_lines(things(system), frame_trajectory(system, mbs.State.at(system)))
    first, second = (line[0, :-3] for line in gears.lines)
    np.testing.assert_allclose(np.linalg.norm(first - [0, 0, 0.06], axis=1), 0.04, rtol=1e-12)
    apart = np.linalg.norm(first[:, None] - second[None], axis=2)
    assert apart.min() < 1e-12 and np.sum(apart < 1e-9) == 1
    worm, thread, wheel = WormGear(1, 30, module=4e-3, radius=0.02).drawing()
    assert worm.radius + wheel.radius == 0.08
    angle = np.unwrap(np.arctan2(thread.points[:, 1], thread.points[:, 0]))
    lead = 2 * np.pi * (thread.points[-1, 2] - thread.points[0, 2]) / (angle[-1] - angle[0])
    np.testing.assert_allclose(lead, np.pi * 4e-3, rtol=1e-9)


@pytest.mark.parametrize("turn", [0.0, 0.1])
@pytest.mark.parametrize("internal", [False, True])
def test_teeth_of_drawn_gears_stand_in_the_gaps_of_the_other(internal, turn):
    b = mbs.SystemBuilder()
    distance = -0.04 if internal else 0.08
    for name, x in {"pinion": 0.0, "wheel": distance}.items():
        b.body(name, 1.0, inertia=1e-2)
        b.joint(name, mbs.Revolute("z"), "ground", name, parent_frame=(x, 0, 0))
    b.gear_pair("mesh", "pinion", "wheel", teeth=(20, 60), module=2e-3, phase=0.4, internal=internal)
    system = b.build()
    rolled = (0.4 + 20 * turn) / 60 * (1 if internal else -1)  # the middle of the play
    state = mbs.State.at(system, pinion=turn, wheel=rolled)
    approach = mbs.dynamics.element_reports(system, state).results["mesh"]["approach"].value
    np.testing.assert_allclose(approach, 0.0, atol=1e-12)
    (gears,) = thing_lines(things(system), frame_trajectory(system, state))
    small, large = (part.rims[0, 0][:, :2] for part in gears.rounds)
    tips = [(points[1:-1:4] + points[2:-1:4]) / 2 for points in (small, large)]  # their middles
    assert np.all(Path(large).contains_points(tips[0]) == internal)
    assert not np.any(Path(small).contains_points(tips[1]))
    reach = np.linalg.norm(small - [distance, 0], axis=1)
    far = np.linalg.norm(large - [distance, 0], axis=1)
    assert (reach.max() > far.min() + 2e-3) if internal else (reach.min() < far.max() - 2e-3)  # by a module


def test_a_drum_is_drawn_about_its_joint():
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    b.body("drum", 20.0, inertia=0.3)
    b.joint("turn", mbs.Revolute("y"), "ground", "drum", parent_frame=(0.1, 0, 0.3))
    b.body("load", 50.0)
    b.joint("lift", mbs.Prismatic("z"), "ground", "load", parent_frame=(0.3, 0, -1.0))
    rope = [Winch(("ground", (0.3, 0, 0.3)), "turn", radius=0.2), Attachment("load")]
    b.cable("rope", rope, stiffness=1e5, free_length=1.3)
    system = b.build()
    film = frame_trajectory(system, mbs.State.at(system, turn=0.7))
    (thing,) = thing_lines(things(system), film)
    (drum,) = thing.rounds
    np.testing.assert_allclose(drum.centres[0].mean(axis=0), [0.1, 0, 0.3], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(drum.rims[0][..., [0, 2]] - [0.1, 0.3], axis=-1), 0.2, rtol=1e-12)
    (rope_thing,) = things(system)
    assert system.topology.frame_body[rope_thing.frames[rope_thing.shapes[1].frame]] == 0  # it turns with its body
    ax = viz.plot_mechanism(system, mbs.State.at(system), "xz", ax=Figure().add_subplot())
    (feet,) = (line.get_xydata() for line in ax.lines if line.get_marker() == 6)
    np.testing.assert_allclose(feet, [[0.1, 0.3]], atol=1e-12)  # of the bearing, none where the rope leaves


@pytest.mark.long
@pytest.mark.parametrize("kind", [*WRAPS])
def test_line_of_a_cable(kind):
    b = mbs.SystemBuilder()
    b.body("load", 1.0)
    off = 0.0 if kind == "sheave" else 0.4
    b.joint("lift", mbs.Prismatic("z"), "ground", "load", parent_frame=(1.0, off, -0.3))
    b.cable("rope", [Attachment(("ground", (-1, 0, -0.2))), WRAPS[kind], Attachment("load")], stiffness=1e4)
    system = b.build()
    state = mbs.State.at(system, lift=-0.2)
    (rope,) = thing_lines(things(system), frame_trajectory(system, state))
    line = rope.threads[0][0]
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    length = float(mbs.dynamics.cable_states(system, state)["rope"].length)
    assert length - 1e-4 < steps.sum() <= length + 1e-12
    from_axis = np.linalg.norm(line[:, [0, 2]] if kind != "sphere" else line, axis=1)
    np.testing.assert_allclose(from_axis[1:-1], 0.3, atol=1e-9)
    directions = np.diff(line, axis=0)[steps > 1e-9] / steps[steps > 1e-9, None]
    assert np.min(np.sum(directions[1:] * directions[:-1], axis=1)) > np.cos(0.1)  # no corner
    assert len(rope.lines) + len(rope.balls) + len(rope.rounds) == 1
    ax = viz.plot_mechanism(system, state, "xz", ax=Figure().add_subplot())
    assert any(np.array_equal(drawn.get_xydata(), line[:, [0, 2]]) for drawn in ax.lines)


@pytest.mark.long
def test_line_of_a_closed_belt():
    b = mbs.SystemBuilder()
    b.body("pulley", 1.0, inertia=0.1)
    b.joint("pin", mbs.Revolute("z"), "ground", "pulley", parent_frame=(1.0, 0, 0))
    wheels = [Sheave("ground", 0.3, side="+"), Eyelet(("ground", (0.5, -0.5, 0))), Sheave("pulley", 0.2, side="+")]
    b.cable("belt", wheels, axial_stiffness=1e4, free_length=3.5, closed=True)
    system = b.build()
    (belt,) = thing_lines(things(system), frame_trajectory(system, mbs.State.at(system)))
    closed = np.concatenate([belt.threads[0][0], belt.threads[0][0][:1]])
    length = float(mbs.dynamics.cable_states(system, mbs.State.at(system))["belt"].length)
    assert length - 1e-3 < np.sum(np.linalg.norm(np.diff(closed, axis=0), axis=1)) <= length + 1e-12
