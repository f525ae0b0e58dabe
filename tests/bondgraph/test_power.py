"""Powers, balances, causality and state equations of bond graphs against the dynamics they picture."""

import equinox as eqx
import jax
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.bondgraph import junction_residual
from jaxmbs.bondgraph._views import VIEWS
from jaxmbs.constraints._kic import dependent_columns
from jaxmbs.dynamics._efforts import element_names
from tests.bondgraph import cases
from tests.cases import models
from tests.cases.test_slider_crank import OMEGA, START, TIMES, TORQUE
from tests.zoo import of_all
from tests.zoo.probes import bonds


def largest(powers):
    return max(float(np.max(np.abs(p))) for p in powers.power.values())


of_all_graphs = of_all(quick=("four_bar",), slow=())


@of_all_graphs
def test_every_junction_passes_its_power_on(specimen):
    for powers in bonds(specimen).powers.values():
        for name, power in junction_residual(powers).items():
            assert abs(float(power)) < 1e-12 * largest(powers), name


@of_all_graphs
def test_powers_of_all_elements_sum_to_zero(specimen):
    for powers in bonds(specimen).powers.values():
        assert abs(float(sum(powers.ports().values()))) < 1e-11 * largest(powers)


@of_all_graphs
def test_stores_take_the_rates_of_the_energies(specimen):
    kinetic, potential, springs = bonds(specimen).energy_rates
    gravity, powers = potential - springs, bonds(specimen).powers
    ports = {view: powers[view].ports() for view in VIEWS}
    close = {"rtol": 1e-10, "atol": 1e-12 * largest(powers["detailed"])}
    detailed = sum(p for name, p in ports["detailed"].items() if name.split(":")[0] in ("I", "m", "GR"))
    np.testing.assert_allclose(detailed, kinetic, **close)
    for view in ("inertia", "hamiltonian"):  # the bond of I* alone does not conserve
        np.testing.assert_allclose(ports[view]["I*"] + ports[view]["GR"], kinetic, **close)
        assert abs(float(ports[view]["I*"] - kinetic)) > 1e-3
    np.testing.assert_allclose(sum(p for name, p in ports["inertia"].items() if name[:2] == "C:"), springs, **close)
    np.testing.assert_allclose(sum(p for name, p in ports["detailed"].items() if name[:3] == "mg:"), gravity, **close)
    np.testing.assert_allclose(ports["inertia"]["gravity"], gravity, **close)


@of_all_graphs
def test_resistors_and_sources_pass_the_elements_powers(specimen):
    system, ports = specimen.system, bonds(specimen).powers["detailed"].ports()
    elastic, elements = {name for group in system.elastic for name in group.names}, bonds(specimen).of_elements
    sources = {name for group in system.forces for name in group.names if group.law.is_source}
    for name, power in zip(element_names(system), elements, strict=True):
        place = f"{name}.strain" if name in elastic else name
        found = ports.get(f"{'Se' if name in sources else 'R'}:{place}", 0.0)
        np.testing.assert_allclose(found, -power, rtol=1e-11, atol=1e-13)


@of_all_graphs
@pytest.mark.parametrize("view", VIEWS)
def test_state_equations_read_back(specimen, view):
    equations, expected = bonds(specimen).equations[view], bonds(specimen).truth
    for found, right in zip(equations, expected, strict=True):
        np.testing.assert_allclose(found, right, rtol=1e-10, atol=1e-11)
    q_dot = specimen.state.velocities[dependent_columns(specimen.system)]
    np.testing.assert_allclose(equations[1], bonds(specimen).phi_dot, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(equations[2], q_dot, rtol=1e-9, atol=1e-11)


@pytest.mark.long
def test_wholly_driven_mechanism_along_its_motion():
    """Without freedom the drives are the only root, and their power is the textbook's torque times speed."""
    system = models.slider_crank(drive=lambda t: START + OMEGA * t, gas_force=-200.0)
    angles = START + OMEGA * TIMES
    states = [
        mbs.State.at(system, guess={"main": angle} | models.slider_crank_guess(angle), t=t)
        for angle, t in zip(angles, TIMES, strict=True)
    ]
    powers = mbs.bondgraph.bond_powers(system, cases.stacked(states))
    assert powers.graph.roots == ("drives",)
    np.testing.assert_allclose(-powers.net_power("drive"), TORQUE * OMEGA, rtol=1e-6)
    worst = max(np.max(np.abs(p)) for p in junction_residual(powers).values())
    assert worst < 1e-11 * largest(powers)
    graph = mbs.bondgraph.bond_graph(system, "detailed", states[0])
    assert set(graph.dependent) == {"I:crank", "m:crank", "I:rod", "m:rod", "m:slider"}


@pytest.mark.long
def test_powers_differentiate():
    system = cases.slider_crank()
    state, stiffness = cases.slider_crank_state(system), system.forces[0].law.stiffness

    def power(k):
        changed = eqx.tree_at(lambda s: s.forces[0].law.stiffness, system, stiffness.at[0].set(k))
        return mbs.bondgraph.bond_powers(changed, state, "inertia").ports()["C:buffer"]

    value, slope = jax.jit(jax.value_and_grad(power))(300.0)
    np.testing.assert_allclose(slope, value / 300.0, rtol=1e-12)


def test_faults():
    system = cases.double_pendulum()
    with pytest.raises(ValueError, match="view must be one of detailed, inertia, hamiltonian"):
        mbs.bondgraph.bond_graph(system, "paper")
    b = mbs.SystemBuilder()
    b.body("block", 1.0, inertia=0.1)
    b.joint("glue", mbs.Weld(), "ground", "block")
    with pytest.raises(mbs.ModelError, match="the mechanism has no freedom and no drive"):
        mbs.bondgraph.bond_graph(b.build())
