"""Things in pictures: cables are as long as they are, on their wheels and tangent to them; gears touch."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import jaxmbs as mbs
from jaxmbs import viz
from jaxmbs.forces import Attachment, BevelGear, Eyelet, Sheave, WormGear, WrapCylinder, WrapSphere
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
    assert len(rope.lines) + len(rope.balls) == 1
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
