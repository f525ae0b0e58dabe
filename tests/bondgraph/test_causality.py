"""Structure and causality of the three views."""

import jax
import pytest

import jaxmbs as mbs
from jaxmbs.bondgraph._views import VIEWS

from . import cases


def shares(graph):
    return {s.name: (s.independent, s.dependent, s.idle) for s in graph.storages}


@pytest.mark.slow
def test_dependent_inertias_of_a_double_pendulum(graphs):
    """Two angular momenta are states, and in the plane the two linear ones follow from them."""
    graph = graphs["pendulum detailed"]
    assert graph.dependent == ("m:upper", "m:lower")
    assert shares(graph) == {"I:upper": (1, 0, 2), "m:upper": (0, 2, 1), "I:lower": (1, 0, 2), "m:lower": (0, 2, 1)}


@pytest.mark.slow
def test_point_masses_have_no_turning_inertia(graphs):
    graph = graphs["points detailed"]
    assert graph.dependent == ()
    assert shares(graph) == {"m:upper": (1, 1, 1), "m:lower": (1, 1, 1)}


def test_dependent_inertias_depend_on_the_pose():
    """Points on a stretched pendulum move across it alone."""
    system = cases.double_pendulum(0.0)
    state = mbs.State.at(system, shoulder=0.0, elbow=0.0)
    aligned = shares(mbs.bondgraph.bond_graph(system, "detailed", state))
    assert aligned == {"m:upper": (1, 0, 2), "m:lower": (1, 0, 2)}


@pytest.mark.slow
def test_one_freedom_leaves_one_state(graphs):
    graph = graphs["crank detailed"]
    assert graph.dependent == ("m:crank", "I:rod", "m:rod", "m:slider")
    assert graphs["crank hamiltonian"].dependent == ()


@pytest.mark.slow
def test_drives_set_the_flow_of_their_inertias(graphs):
    graph = graphs["arm detailed"]
    assert shares(graph)["I:tip"] == (3, 0, 0)
    assert set(graph.dependent) == {"I:arm", "m:arm", "m:tip"}
    field = graphs["arm inertia"]
    assert [(s.junction, s.independent, s.dependent) for s in field.storages] == [("phi_dot", 3, 0), ("drives", 0, 1)]


@pytest.mark.slow
def test_moduli_that_differ_by_their_signs_are_independent():
    """Two masses whose velocities are the sum and the difference of two rates hold two states, not one."""
    b = mbs.SystemBuilder()
    for name, mass in (("carrier", 0.0), ("sum", 1.0), ("difference", 2.0)):
        b.body(name, mass=mass)
    along = mbs.Prismatic("x")
    b.joint("base", along, "ground", "carrier")
    b.joint("plus", along, "carrier", "sum")
    b.joint("minus", along, "carrier", "difference")
    b.constraint("opposite", mbs.Coupler({"plus": 1.0, "minus": 1.0}))
    graph = mbs.bondgraph.bond_graph(b.build(independent=["base", "plus"]), "detailed")
    assert graph.dependent == ()
    assert shares(graph) == {"m:sum": (1, 0, 2), "m:difference": (1, 0, 2)}


@pytest.mark.slow
def test_an_elastic_body_is_an_inertia_on_its_flow(graphs):
    """Six rigid flows, six of the tip, one mode.  The carrier takes the state of its swing, the tool the four of tip
    and wrist, the body that of its mode: what moves with swing, hinge and tip depends, the rest idles."""
    graph = graphs["beam detailed"]
    assert graph["y:arm"].size == graph["I:arm.flow"].size == graph["GR:arm.flow"].size == 13
    assert graph["C:arm.strain"].size == graph["R:arm.strain"].size == 7
    found = shares(graph)
    assert found == {
        "I:carrier": (1, 0, 2),
        "m:carrier": (0, 0, 3),
        "I:tool": (2, 1, 0),
        "m:tool": (2, 1, 0),
        "I:arm.flow": (1, 9, 3),
    }
    assert {"C:arm.strain", "R:arm.strain", "gravity", "I*", "GR"} <= set(graphs["beam inertia"].order)
    assert {"y:arm", "GR:arm.flow"}.isdisjoint(graphs["beam inertia"].order)


@pytest.mark.slow
@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("name", ["pendulum", "points", "crank", "arm", "beam"])
def test_causal_rules(graphs, name, view):
    """One bond sets the flow of a 1-junction, one the effort of a 0-junction; transformers pass both on."""
    graph = graphs[f"{name} {view}"]
    own = {s.name: s.independent for s in graph.storages if s.junction != "drives"}
    for element in graph.elements:
        near = [bond.stroke == ("tail" if sign > 0 else "head") for bond, _, sign in graph.bonds_of(element.name)]
        if element.name == "phi_dot":  # a vector: several inertias may share its components
            assert near.count(False) >= 1 and sum(own.values()) == element.size
        elif element.kind == "1":
            assert near.count(False) == 1, element.name
        elif element.kind in ("0", "TF", "MTF"):
            assert near.count(True) == 1, element.name
        elif element.kind in ("Se", "GR", "C", "R"):
            assert not any(near), element.name
        elif element.kind == "Sf":
            assert all(near), element.name
        else:
            assert near.count(True) == (own.get(element.name, 0) > 0), element.name


@pytest.mark.slow
def test_parameters_known_to_be_zero_leave_their_element_out(graphs):
    names = set(graphs["arm inertia"].order)
    assert {"C:bushing", "R:grease", "C:stay", "R:stay", "Se:wind", "Se:push", "gravity"} <= names
    assert not {"R:bushing", "C:grease"} & names


@pytest.mark.slow
def test_views_are_as_small_as_the_paper_draws_them(graphs):
    graph = graphs["pendulum hamiltonian"]
    assert [(b.tail, b.head, b.stroke) for b in graph.bonds] == [
        ("phi_dot", "I*", "head"),
        ("GR", "phi_dot", "head"),
        ("Q", "phi_dot", "head"),
    ]
    assert "1 I, 1 GR, 1 Se" in graph.describe()


def test_traced_systems_have_no_strokes():
    @jax.jit
    def strokes(system):
        graph = mbs.bondgraph.bond_graph(system, "detailed")
        assert {bond.stroke for bond in graph.bonds} == {""}
        return system.mass

    strokes(cases.slider_crank())
