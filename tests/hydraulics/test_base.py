"""Bonds inside elements of circuits: junctions conserve, ports bring what is lost or stored; stored energies."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

import jaxmbs as mbs
from jaxmbs import hydraulics as H
from jaxmbs.forces._element_bonds import bond_sums, ends, kind_of, power_into
from jaxmbs.hydraulics._pump import PumpOnShaft

PRESSURES = [1.6e7, 2e5, 6e6, 2e6]
ELEMENTS = {
    "orifice": (H.Orifice(1e-6), None, {}),
    "valve": (H.Valve(5e-4, 3.5e6, overlap=-0.1), 0.05, {}),
    "relief": (H.ReliefValve(1.5e7, 1e-9), None, {}),
    "check": (H.CheckValve(5e-4, 1e6), None, {}),
    "pump": (H.Pump(5e-6, 1e-12, 0.02), 90.0, {}),
    "shaft": (PumpOnShaft(H.Pump(5e-6, 1e-12, 0.02)), -90.0, {}),
    "line": (H.Line(2.0, 0.012, loss=2.0), None, {"q": 3e-4}),
}


def called(element, signal, s):
    u = jnp.array(PRESSURES[: len(element.ports)] + ([] if signal is None else [signal]))
    return element, u, {name: jnp.asarray(value) for name, value in s.items()}


@pytest.mark.parametrize("name", ELEMENTS)
def test_every_junction_conserves_and_ports_bring_what_is_lost_or_stored(name):
    element, u, s = called(*ELEMENTS[name])
    bonds = element.bonds(u, s, 0.0)
    largest = max(abs(float(bond.power)) for bond in bonds.values())
    for end in {end for bond in bonds for end in ends(bond)}:
        around = {bond: value for bond, value in bonds.items() if end in ends(bond)}
        if kind_of(end) in ("0", "1", "TF"):
            into = sum((value.power if ends(bond)[1] == end else -value.power) for bond, value in around.items())
            assert abs(float(into)) < 1e-12 * largest, end
    sums = bond_sums(bonds)
    flows = jnp.atleast_1d(element.output(u, s, 0.0))
    through = sum(-sign * flows[e] * p for p, (e, sign) in zip(u, element.port_flows, strict=False))
    turned = -flows[1] * u[2] if name == "shaft" else 0.0  # torque that the joint gives the pump
    np.testing.assert_allclose(sums.exchanged, through + turned, rtol=1e-12)
    balance = sums.exchanged + sums.supplied - sums.dissipated - sums.stored
    assert abs(float(balance)) < 1e-12 * largest and float(sums.dissipated) > 0.0
    if s:
        rates = element.rate(u, s, 0.0)
        stored = jax.jvp(element.stored_energy, (s,), (rates,))[1]
        np.testing.assert_allclose(stored, sums.stored, rtol=1e-12)


class Leak(H.AbstractTwoPort):
    """An element of the user."""

    def flow(self, drop, signal=None):
        return 1e-12 * drop


class Tee(H.AbstractHydraulicElement):
    """An element of three ports that does not declare its bonds."""

    ports = ("a", "b", "c")
    port_flows = ((0, -1), (0, 1), (1, 1))

    def output(self, u, s, t):
        return jnp.stack([1e-12 * (u[0] - u[1]), 1e-12 * (u[1] - u[2])])


@pytest.mark.parametrize("element", [Leak(), Tee()])
def test_elements_of_users_are_resistors(element):
    u = jnp.array(PRESSURES[: len(element.ports)])
    sums = bond_sums(element.bonds(u, {}, 0.0))
    np.testing.assert_allclose(sums.exchanged, sums.dissipated, rtol=1e-12)


GAS = H.Accumulator(2e-3, 5e6, exponent=1.3, dead_volume=1e-5)


@pytest.mark.parametrize("node", [H.Volume(5e-3), GAS, H.Accumulator(2e-3, 5e6, exponent=1.0)])
@pytest.mark.parametrize("p", [2e6, 4.995e6, 5.004e6, 3e7])
def test_stored_energy_is_the_work_of_the_oil(node, p):
    places = [q for q in (4.99e6, 5e6, 5.01e6) if q < p]
    capacity, stored = mbs.jit(lambda p: node.capacity(p)), mbs.jit(jax.value_and_grad(lambda p: node.stored(p)))
    integrand = lambda q: q * float(capacity(jnp.asarray(q)))
    expected = sum(quad(integrand, a, b, epsrel=1e-11)[0] for a, b in zip([0.0, *places], [*places, p], strict=True))
    energy, slope = stored(jnp.asarray(p))
    np.testing.assert_allclose(energy, expected, rtol=1e-9)
    np.testing.assert_allclose(slope, p * capacity(jnp.asarray(p)), rtol=1e-9)


def test_nodes_take_in_what_flows_into_them():
    for node, s in ((GAS, {"p": jnp.asarray(9e6)}), (H.Tank(1e5), {})):
        bonds = node.bonds(3e-4, s, 0.0)
        p = 9e6 if s else 1e5
        np.testing.assert_allclose(bond_sums(bonds).exchanged, 3e-4 * p)
        np.testing.assert_allclose(power_into(bonds, ("C", "Se")), 3e-4 * p)
