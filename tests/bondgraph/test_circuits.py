"""A hydraulic circuit with a cylinder, a mechanism and a pump on a shaft in the bond graph: its audit closes."""

import jax
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import forces as F
from jaxmbs import hydraulics as H
from jaxmbs.bondgraph import bond_graph, bond_powers, element_powers, junction_residual


def machine():
    """A mass on a cylinder, which a pump on a driven rotor feeds through a line and a valve."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    b.body("mass", mass=500.0)
    b.joint("slide", mbs.Prismatic("z"), "ground", "mass")
    cylinder = F.HydraulicCylinder((4e-3, 3e-3), (1e-3, 1e-3), 1.2e9, leakage=1e-12, damping=200.0)
    b.force("boom", cylinder, joint="slide")
    b.body("rotor", mass=1.0, inertia=(0.1, 0.1, 0.2))
    b.joint("turn", mbs.Revolute("z"), "ground", "rotor")
    b.force("drive", F.Actuator(lambda x, v, t: 20.0 * (100.0 - v)), joint="turn")
    b.hydraulic("tank", H.Tank(1e5))
    b.hydraulic("supply", H.Volume(5e-3, 1.2e9, pressure=1.45e7))
    b.hydraulic("hose", H.Volume(1e-3, 1.2e9, pressure=1.45e7))
    b.hydraulic("gas", H.Accumulator(1e-3, 9e6))
    b.hydraulic("pump", H.Pump(5e-6, 1e-12, 0.01), ports={"a": "tank", "b": "supply"}, shaft="turn")
    b.hydraulic("feed", H.Pump(1e-6, 1e-12, 0.01), ports={"a": "tank", "b": "supply"}, signal=150.0)
    b.hydraulic("relief", H.ReliefValve(1.4e7, 1e-9), ports={"a": "supply", "b": "tank"})
    b.hydraulic("line", H.Line(3.0, 0.012), ports={"a": "supply", "b": "hose"})
    b.hydraulic("check", H.CheckValve(5e-4, 1e6), ports={"a": "hose", "b": "gas"})
    b.hydraulic("bleed", H.Orifice(1e-6), ports={"a": "gas", "b": "tank"})
    ways = {"p": "hose", "t": "tank", "a": "boom.p0", "b": "boom.p1"}
    b.hydraulic("valve", H.Valve(5e-4, 3.5e6), ports=ways, signal=lambda t: 0.4 + 0.3 * t)
    return b.build()


@pytest.fixture(scope="module")
def moved():
    system = machine()
    start = mbs.State.at(system, velocities={"turn": 100.0})
    return system, mbs.simulate(system, start, ts=np.linspace(0.0, 0.5, 11))


def state(motion, k=5):
    return jax.tree.map(lambda x: x[k], motion.states)


@pytest.mark.slow
def test_supplied_is_stored_dissipated_and_mechanical(moved):
    powers = element_powers(*moved)
    for name, missing in powers.residual.items():
        parts = (powers.mechanical, powers.stored, powers.dissipated, powers.supplied, powers.exchanged)
        largest = max(float(np.abs(part[name]).max()) for part in parts)
        assert largest > 1e-3 and np.abs(missing).max() < 1e-10 * largest, name
        assert np.min(powers.dissipated[name]) >= 0.0
    total = powers.totals
    largest = np.abs(total["supplied"]).max()
    assert np.abs(total["exchanged"]).max() < 1e-10 * largest
    used = total["mechanical"] + total["stored"] + total["dissipated"]
    np.testing.assert_allclose(total["supplied"], used, atol=1e-10 * largest)
    assert np.all(powers.supplied["feed"] > 1e3) and np.all(np.abs(powers.supplied["pump"]) == 0.0)


@pytest.mark.slow
def test_the_shaft_takes_the_power_of_its_pump(moved):
    system, motion = moved
    powers = element_powers(system, motion)
    speed = system.velocities(motion.states)["turn"]
    rise = motion.internal("supply.p") - 1e5
    np.testing.assert_allclose(powers.mechanical["pump shaft"], -(5e-6 * rise + 0.01 * speed) * speed, rtol=1e-12)
    np.testing.assert_allclose(powers.exchanged["pump shaft"], powers.mechanical["pump shaft"], rtol=1e-12)
    heat = 0.01 * speed**2 + 1e-12 * rise**2
    np.testing.assert_allclose(powers.dissipated["pump"], heat, rtol=1e-9)
    np.testing.assert_allclose(powers.domain("mechanical")["feed"], (1e-6 * rise + 1.5) * 150.0, rtol=1e-12)


@pytest.mark.parametrize("view", ["detailed", "inertia"])
@pytest.mark.slow
def test_nodes_join_the_graphs_of_elements(moved, view):
    system, motion = moved
    powers = bond_powers(system, state(motion), view)
    largest = max(float(abs(power)) for power in powers.power.values())
    assert all(abs(float(power)) < 1e-12 * largest for power in junction_residual(powers).values())
    assert abs(float(sum(powers.ports().values()))) < 1e-11 * largest
    for name in (
        "0:valve.a -> 0:boom.chamber0",
        "rate:pump shaft -> 1:pump.shaft",
        "0:hose.pressure -> 1:check.flow",
    ):
        assert abs(powers.power[name]) > 0.0
    assert not any(element.kind == "port" for element in powers.graph.elements)


@pytest.mark.slow
def test_pressures_and_flows_are_states_of_integral_causality(moved):
    system, motion = moved
    graph = bond_graph(system, "detailed", state(motion))
    strokes = {bond.name: bond.stroke for bond in graph.bonds}
    assert all(strokes[f"0:{node}.pressure -> C:{node}.oil"] == "tail" for node in ("supply", "hose", "gas"))
    assert strokes["1:line.flow -> I:line.oil"] == "head" and strokes["0:tank.pressure -> Se:tank.tank"] == "tail"
    assert strokes["rate:pump shaft -> 1:pump.shaft"] == "tail"  # the joint gives the speed
    assert strokes["1:valve.p-a -> R:valve.p-a"] == "head"
    for element in (e for e in graph.elements if e.kind in "01"):
        here = [b.stroke == ("tail" if b.tail == element.name else "head") for b, *_ in graph.bonds_of(element.name)]
        if element.domain == "fluid":  # one bond gives the effort of a 0-junction, the flow of a 1-junction
            assert sum(here) == (1 if element.kind == "0" else len(here) - 1), element.name
    assert "<svg" in graph._repr_svg_()


@pytest.mark.slow
def test_a_plot_of_an_element_of_a_circuit(moved):
    ax = mbs.viz.plot_element_power(moved[1], element_powers(*moved), "valve")
    assert "dissipated" in [text.get_text() for text in ax.get_legend().get_texts()]
