"""Names beside points: not over lines, not over each other, within the picture."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import jaxmbs as mbs
from jaxmbs import viz

PIN = mbs.Revolute("z")


def crank():
    """A slider-crank whose guide is declared at the bearing of its crank."""
    b = mbs.SystemBuilder()
    for name, length in (("crank", 0.1), ("rod", 0.3)):
        b.body(name, 1.0, com=(length / 2, 0, 0), inertia=0.01)
    b.body("piston", 1.0)
    b.joint("bearing", PIN, "ground", "crank")
    b.joint("elbow", PIN, "crank", "rod", parent_frame=(0.1, 0, 0))
    b.joint("wrist", PIN, "rod", "piston", parent_frame=(0.3, 0, 0), child_frame=(0.36, 0, 0))
    b.joint("guide", mbs.Prismatic("x"), "ground", "piston")
    return b.build()


@pytest.fixture(scope="module")
def turned():
    system = crank()
    return system, [mbs.State.at(system, bearing=angle, guess={"elbow": -angle}) for angle in (0.6, 2.2)]


def boxes(ax):
    """Extents of all names, in pixels."""
    renderer = ax.figure.canvas.get_renderer()
    return {note.get_text(): note.get_window_extent(renderer) for note in ax.texts}


@pytest.mark.parametrize("number", [0, 1])
def test_names_lie_over_no_line(turned, number):
    system, states = turned
    figure = Figure((4.0, 3.0), layout="constrained")
    FigureCanvasAgg(figure)
    ax = viz.plot_mechanism(system, states[number], ax=figure.add_subplot(), names=True)
    figure.canvas.draw()
    found = boxes(ax)
    assert sorted(", ".join(found).split(", ")) == ["bearing", "elbow", "guide", "wrist"]
    for box in found.values():
        assert not any(box.overlaps(other) for other in found.values() if other is not box)
        for line in ax.lines:
            ends = ax.transData.transform(line.get_xydata())
            ends = ends[np.all(np.isfinite(ends), axis=1)]
            if line.get_linestyle() == "None" or len(ends) < 2:
                continue
            path = np.concatenate([np.linspace(a, b, 50) for a, b in zip(ends[:-1], ends[1:], strict=True)])
            inside = np.all((path > box.get_points()[0]) & (path < box.get_points()[1]), axis=1)
            assert not inside.any()


def test_a_slider_is_drawn_at_its_pin_and_not_at_the_crank(turned):
    """The block, its name, and the tag of the scene; no bar from the bearing to the wrist."""
    system, states = turned
    ax = viz.plot_mechanism(system, states[0], ax=Figure().add_subplot(), names=True)
    (block,) = ax.patches
    middle = block.get_xy()[:4].mean(axis=0)
    found = np.array([0.1 * np.cos(0.6) + np.sqrt(0.3**2 - (0.1 * np.sin(0.6)) ** 2), 0.0])
    np.testing.assert_allclose(middle, found, atol=1e-6)
    places = {note.get_text(): note.xy for note in ax.texts}
    np.testing.assert_allclose(places["wrist, guide"], found, atol=1e-6)
    bars = [line for line in ax.lines if line.get_linewidth() == 3.0]
    assert len(bars) == 2  # crank and rod
    tags = {tag["name"]: tag for tag in viz.scene(system, states[0]).data["objects"][0]["tags"]}
    assert tags["guide"]["body"] == tags["wrist"]["body"] + 1  # on the piston
    np.testing.assert_allclose(tags["guide"]["point"], [0.36, 0.0, 0.0], atol=1e-6)


def test_a_flat_picture_has_room_for_its_numbers(turned):
    system, _ = turned
    straight = mbs.State.at(system, bearing=0.0, guess={"elbow": 0.0})
    ax = viz.plot_mechanism(system, straight, ax=Figure().add_subplot())
    low, high = ax.dataLim.get_points()
    assert (high - low)[1] > 0.3 * (high - low)[0]
