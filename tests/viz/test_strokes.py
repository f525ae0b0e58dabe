"""Symbols of line drawings: cylinders keep their lengths, elements stand side by side, each kind is drawn."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import jaxmbs as mbs
from jaxmbs import drawings, forces, viz
from jaxmbs.viz._strokes import element_strokes

NOTHING = forces.Actuator(lambda x, v, t: 0.0 * x)
STROKES = {  # of laws on a joint: on a slide, on a pin
    "spring": (forces.SpringDamper(1e2), 1, 1),
    "damper": (forces.SpringDamper(damping=3.0), 4, 3),
    "both": (forces.SpringDamper(1e2, 3.0), 9, 4),
    "motor": (NOTHING, 3, 2),
    "Maxwell": (forces.Maxwell(1e2, 3.0), 5, 3),
}


def points_of(kind, length, reach=(1.0, 1.6), lane=0.0):
    ends = np.array([[0.0, 0.0], [length, 0.0]])
    return [stroke.points for stroke in element_strokes(kind, ends, reach, 0.05, lane)]


@pytest.mark.parametrize("kind", ["damper", "cylinder", "actuator"])
def test_a_barrel_keeps_its_length_and_holds_its_piston(kind):
    short, long = (points_of(kind, length) for length in (1.0, 1.6))
    closed = {"damper": 1}.get(kind, 0)
    np.testing.assert_array_equal(short[closed], long[closed])  # the barrel, on the first point
    rods = [np.ptp(shown[2 if closed == 0 else 3][:, 0]) for shown in (short, long)]
    np.testing.assert_allclose(*rods, rtol=1e-12)
    for shown in (short, long):
        piston = shown[1 if closed == 0 else 2]
        low, high = shown[closed].min(axis=0), shown[closed].max(axis=0)
        assert np.all(piston > low - 1e-12) and np.all(piston < high + 1e-12)


@pytest.mark.parametrize("kind", drawings.SYMBOLS)
def test_every_symbol_leads_from_end_to_end(kind):
    for lane in (0.0, 0.5):
        points = np.concatenate(points_of(kind, 1.5, lane=lane))
        for end in ((0.0, 0.0), (1.5, 0.0)):
            assert np.min(np.linalg.norm(points - end, axis=1)) < 0.07  # the width of a barrel
    points = np.concatenate(points_of(kind, 0.0, (0.0, 0.0)))
    assert np.all(np.isfinite(points))  # ends that coincide


@pytest.mark.parametrize("name", [*STROKES])
def test_laws_on_joints_are_drawn(name):
    """More strokes than without the law, by the number of its symbol."""
    law, *wanted = STROKES[name]

    def count(kind, force):
        b = mbs.SystemBuilder()
        b.body("arm", 1.0, com=(0.1, 0, 0), inertia=0.1)
        b.joint("joint", kind, "ground", "arm")
        b.frame("tip", "arm", (0.4, 0, 0))
        if force is not None:
            b.force("law", force, joint="joint")
        system = b.build()
        ax = viz.plot_mechanism(system, mbs.State.at(system, joint=0.2), "xz", ax=Figure().add_subplot())
        return len(ax.lines) + len(ax.patches)

    found = [count(kind, law) - count(kind, None) for kind in (mbs.Prismatic("x"), mbs.Revolute("y"))]
    assert found == wanted
