"""Contacts in pictures: surfaces, points that touch, and forces as arrows."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import jaxmbs as mbs
from jaxmbs import contact as C
from jaxmbs import viz
from jaxmbs.viz._element_arrows import arrows_along
from jaxmbs.viz._shape_lines import thing_lines
from jaxmbs.viz._things import things
from jaxmbs.viz.scenes._trajectory import frame_trajectory

ANGLES = 2 * np.pi * np.arange(24) / 24
CAM = C.ClosedCurve(0.03 * np.c_[np.cos(ANGLES), np.sin(ANGLES)])
X = np.linspace(-1.0, 1.0, 9)
PAIRS = {  # a pair and a place of the round part where it touches
    "plane": (C.SphereOnPlane(0.05), (0.1, 0.2, 0.049)),
    "sphere": (C.SphereOnSphere(0.05, 0.1), (0.0, 0.0, 0.149)),
    "tube": (C.SphereInCylinder(0.05, 0.02), (0.021, 0.0, 0.1)),
    "cylinder": (C.CylinderOnPlane(0.05, 0.2), (0.1, 0.2, 0.0)),
    "journal": (C.JournalInBush(0.05, 0.01, 0.2), (0.011, 0.0, 0.0)),
    "cam": (C.RollerOnCurve(CAM, 0.01), (0.039, 0.0, 0.0)),
    "road": (C.WheelOnRoad(C.HeightField(X, 0.0 * X), 0.2), (0.1, 0.0, 0.199)),
}


@pytest.mark.long
@pytest.mark.parametrize("name", [*PAIRS])
def test_lines_of_every_pair(name):
    pair, place = PAIRS[name]
    b = mbs.SystemBuilder()
    b.body("part", 1.0, inertia=1e-3)
    b.joint("part", mbs.Free(), "ground", "part")
    b.contact("touch", pair, "part", "ground", C.HuntCrossley(1e5, 1.0), 0.3)
    system = b.build()
    state = mbs.State.at(system, {"part": (*place, 1.0, 0.0, 0.0, 0.0)}, {"part": (0.1, 0, 0, 0, 0, 0)})
    (found,) = thing_lines(things(system), frame_trajectory(system, state))
    load = mbs.dynamics.contact_load(system, state, "touch")
    touches = np.asarray(load.depth) > 0.0
    assert touches.any()
    np.testing.assert_allclose(found.marks[0][touches], load.point[touches], atol=1e-12)
    assert np.all(np.isnan(found.marks[0][~touches]))
    assert len(found.lines) + len(found.balls) + len(found.rounds) >= 2
    assert all(np.all(np.isfinite(line)) for line in [*found.lines, *(shape.rims for shape in found.rounds)])
    force = arrows_along(system, state)["touch"][1][0]
    np.testing.assert_allclose(force, load.normal_force[:, None] * load.normal + load.friction, rtol=1e-12)
    ax = viz.plot_mechanism(system, state, "xz", ax=Figure().add_subplot(), loads=True)
    plain = viz.plot_mechanism(system, state, "xz", ax=Figure().add_subplot())
    assert len(ax.lines) == len(plain.lines) + len(touches)
    tips = np.array([line.get_xydata()[1] - line.get_xydata()[0] for line in ax.lines if len(line.get_xydata()) == 6])
    largest = np.nanargmax(np.linalg.norm(tips, axis=1))
    assert np.all(np.isfinite(tips).all(axis=1) == touches)  # no dot where nothing presses
    expected = force[:, [0, 2]][largest]
    np.testing.assert_allclose(tips[largest] / np.linalg.norm(tips[largest]), expected / np.linalg.norm(expected))
