"""Drawings of bond graphs: well-formed, complete, nothing on top of another; powers over time."""

from itertools import combinations
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.textpath import TextPath

import jaxmbs as mbs
from jaxmbs import viz
from jaxmbs.bondgraph._layout import layout, text_of
from jaxmbs.bondgraph._views import VIEWS
from tests import marks
from tests.bondgraph import cases


@pytest.fixture(scope="module")
def swing():
    """A pendulum with a spring, a damper and a motor, and its motion."""
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    b.body("arm", mass=2.0, com=(0.5, 0.0, 0.0), inertia=(0.01, 0.1, 0.1))
    b.joint("pin", cases.PIN, "ground", "arm")
    b.force("spring", mbs.SpringDamper(20.0, 0.8), joint="pin")
    b.force("motor", mbs.Torque((0.0, 0.0, 1.5)), on="arm")
    system = b.build()
    motion = mbs.simulate(system, mbs.State.at(system, pin=0.4), ts=np.linspace(0.0, 1.0, 201))
    return system, motion, mbs.bondgraph.bond_powers(system, motion, "inertia")


NAMES = [f"{system} {view}" for system in ("crank", "arm", "beam") for view in VIEWS]


@pytest.mark.slow
def test_graphs_are_large_enough_to_test(graphs):
    assert len(graphs["arm detailed"].elements) > 30


@pytest.mark.parametrize("name", marks.cases(NAMES, slow=["crank detailed"]))
def test_nothing_overlaps(graphs, name):
    places = layout(graphs[name])
    for (a, p), (b, q) in combinations(places.boxes.items(), 2):
        apart = p[2] <= q[0] or q[2] <= p[0] or p[3] <= q[1] or q[3] <= p[1]
        assert apart, f"{a} lies on {b}"
    for bond in graphs[name].bonds:
        points = np.array(places.paths[bond.name])
        line = np.concatenate([np.linspace(a, b, 50) for a, b in zip(points, points[1:], strict=False)])
        for other, box in places.boxes.items():
            inside = np.all((line > np.array(box[:2]) + 0.5) & (line < np.array(box[2:]) - 0.5), axis=1)
            assert not np.any(inside), f"{bond.name} crosses {other}"


@pytest.mark.parametrize("name", ["crank detailed", "arm detailed", "beam detailed"])
def test_texts_fit_their_boxes(graphs, name):
    boxes = layout(graphs[name]).boxes
    for element in graphs[name].elements:
        text, label = text_of(element)
        for string, size, weight in ((text, 12, "bold"), (label, 10, "normal")):
            if string:
                path = TextPath((0, 0), string, size=size, prop={"family": "DejaVu Sans", "weight": weight})
                assert path.get_extents().width <= boxes[element.name][2] - boxes[element.name][0], string


def test_svg_is_xml_and_complete(graphs, tmp_path):
    graph = graphs["arm detailed"]
    text = viz.draw_bond_graph(graph, tmp_path / "graph.svg")
    assert (tmp_path / "graph.svg").read_text(encoding="utf-8") == text == graph._repr_svg_()
    root = ElementTree.fromstring(text)
    titles = {t.text.rsplit(" (", 1)[0] for t in root.iter("{http://www.w3.org/2000/svg}title")}
    assert titles == {e.name for e in graph.elements} | {b.name for b in graph.bonds}
    paths = list(root.iter("{http://www.w3.org/2000/svg}path"))
    marks = [p.get("d") for p in paths if p.get("class") is None][1::2]
    assert all(mark.count("M") == 2 for mark in marks)  # half arrow and stroke


@pytest.mark.parametrize("name", NAMES)
def test_every_modulated_transformer_has_its_signal_of_the_coordinates(graphs, name):
    """Fig. 2: a full arrow of Psi ends on each MTF and on nothing else; constant transformers have none."""
    places, root = layout(graphs[name]), ElementTree.fromstring(viz.draw_bond_graph(graphs[name]))
    paths = list(root.iter("{http://www.w3.org/2000/svg}path"))
    starts, tips = ([p.get("d") for p in paths if p.get("class") == kind] for kind in ("signal", "tip"))
    modulated = [e.name for e in graphs[name].elements if e.kind == "MTF"]
    assert len(starts) == len(tips) == len(modulated) and ("detailed" not in name or modulated)
    ends = {tuple(float(x) for x in tip.split(" L")[2].split(" Z")[0].split()) for tip in tips}
    boxes = [places.boxes[m] for m in modulated]
    assert ends == {(round((b[0] + b[2]) / 2, 1), round(b[1], 1)) for b in boxes}
    for start in starts:
        x, y = (float(v) for v in start[1:].split(" L")[0].split())
        assert not any(b[0] < x < b[2] and b[1] < y < b[3] for b in places.boxes.values())


def test_names_are_escaped():
    b = mbs.SystemBuilder()
    b.body("a<b & c", 1.0, inertia=0.1)
    b.joint("pin", cases.PIN, "ground", "a<b & c")
    ElementTree.fromstring(viz.draw_bond_graph(mbs.bondgraph.bond_graph(b.build(), "detailed")))


@pytest.mark.slow
def test_widths_follow_the_powers(swing):
    system, motion, powers = swing
    graph = mbs.bondgraph.bond_graph(system, "inertia")
    text = viz.draw_bond_graph(graph, powers=powers)
    values = [a.get("values") for a in ElementTree.fromstring(text).iter("{http://www.w3.org/2000/svg}animate")]
    widths = np.array([[float(w) for w in value.split(";")] for value in values])
    assert widths.shape == (len(graph.bonds), len(motion.ts))
    size = np.array([np.abs(powers.power[bond.name]) for bond in graph.bonds])
    np.testing.assert_allclose(widths, 1.0 + 6.0 * size / size.max(), atol=0.006)
    with pytest.raises(ValueError, match="belong to the inertia view"):
        viz.draw_bond_graph(mbs.bondgraph.bond_graph(system), powers=powers)


@pytest.mark.slow
@pytest.mark.parametrize("by", ["element", "kind"])
def test_plot_power(swing, by):
    _, motion, powers = swing
    ax = Figure().add_subplot()
    assert viz.plot_power(motion, powers, by=by, ax=ax) is ax
    labels = {text.get_text() for text in ax.get_legend().get_texts()}
    element = {"I*", "gravity", "C:spring", "R:spring", "Se:motor"}
    assert labels == (element if by == "element" else {"kinetic", "springs", "dissipated", "sources"})
    below = {line.get_label(): line.get_ydata() for line in ax.figure.axes[1].lines}
    accounts = motion.diagnostics
    for name, expected in (("kinetic", accounts.kinetic), ("dissipated", -accounts.work["spring"])):
        expected = expected - expected[0]
        np.testing.assert_allclose(below[name], expected, atol=1e-3 * np.max(np.abs(expected)))
    assert np.max(np.abs(below["missing"])) < 1e-3 * np.max(accounts.kinetic)


@pytest.mark.slow
def test_plot_power_faults(swing):
    with pytest.raises(ValueError, match="by must be"):
        viz.plot_power(*swing[1:], by="body", ax=Figure().add_subplot())


def test_networkx(graphs):
    pytest.importorskip("networkx")
    graph = graphs["crank detailed"]
    net = graph.to_networkx()
    assert set(net) == set(graph.order) and net.number_of_edges() == len(graph.bonds)
    bond = graph.bonds[-1]
    assert net.edges[bond.tail, bond.head, bond.name]["stroke"] == bond.stroke
    assert net.nodes["m:rod"] == {"kind": "I", "label": "m rod", "size": 3, "domain": "mechanical"}
