"""Bonds inside of elements: every junction has one effort or one flow and passes its power on, as does the whole."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs import forces as F
from jaxmbs.forces._element_bonds import CONSERVING, PORT, bond_sums, ends, kind_of
from jaxmbs.forces._law_at import LawAt
from jaxmbs.friction import LuGre
from jaxmbs.math._rotation import rotation_matrix
from tests.marks import cases

POSE = rotation_matrix(jnp.array([0.3, -0.2, 0.5])), jnp.array([0.01, 0.02, -0.01])
TWIST = jnp.array([0.4, 0.1, -0.7]), jnp.array([0.2, -0.3, 0.1])
CUSHION = F.BumpStop(1e6, lower=0.45, damping=0.3)
CYLINDER = dict(flow_gain=2e-6, supply=2e7, tank=1e5, leakage=1e-10, damping=30.0, length=0.3)
SIZES = (4e-3, 3e-3), (1e-3, 2e-3), 1.5e9
PRESSURES = {"p0": 5e6, "p1": 2e6}
LAWS = {
    "Maxwell": (F.Maxwell(300.0, 20.0), {"stretch": 0.02}),
    "Zener": (F.Zener(300.0, 20.0, 50.0, 0.1), {"stretch": 0.02}),
    "Prony": (F.Prony(10.0, [5.0, 3.0], [0.1, 2.0]), {"stretch": jnp.array([0.1, -0.2])}),
    "FrictionForce": (F.FrictionForce(LuGre(1.5, 5e3, 25.0, 0.15, 2.1, 0.5), 2.0, 0.7), {"bristle": 1e-4}),
    "ElastoPlastic": (F.ElastoPlastic(1e3, 20.0, 0.1), {"elastic": 0.015}),
    "Motor": (F.Motor(12.0, 1.5, 0.05, 0.3, ratio=2.0), {"current": 2.0}),
    "lossy Motor": (F.Motor(12.0, 1.5, 0.05, 0.3, 0.32, max_voltage=10.0, max_torque=1.0), {"current": 2.0}),
    "HydraulicCylinder": (F.HydraulicCylinder(*SIZES, 0.6, **CYLINDER), PRESSURES),
    "varying": (F.HydraulicCylinder(*SIZES, -0.6, **CYLINDER, varying=True, end_cushion=CUSHION), PRESSURES),
    "AirSpring": (F.AirSpring(0.01, 5e5, 0.2), None),
    "PronyBushing": (
        F.PronyBushing(np.arange(1.0, 7.0), np.ones((2, 6)), [0.1, 1.0]),
        {"stretch": jnp.arange(12.0).reshape(2, 6) / 30.0},
    ),
}


def arguments(law, s):
    """(x, v, t) of the law at its states."""
    is_pose = isinstance(law, F.AbstractPoseLaw)
    x, v = (POSE, TWIST) if is_pose else ((jnp.array(0.4),), (jnp.array(0.7),))
    return (law if s is None else LawAt(law, s)), x, v, 0.0


def flow_and_effort(law, x, v, t):
    if len(v) == 1:
        return v[0], law.effort(*x, *v, t)
    force, moment = law.wrench(*x, *v, t)
    return jnp.concatenate(v), jnp.concatenate([moment, force])


@pytest.mark.parametrize("name", cases(LAWS, long=["PronyBushing"]))
def test_junctions_pass_their_power_on(name):
    law, x, v, t = arguments(*LAWS[name])
    bonds = law.bonds(*x, *v, t)
    largest = max(abs(float(b.power)) for b in bonds.values())
    for element in {end for bond in bonds for end in ends(bond)} - {PORT}:
        own = {bond: b for bond, b in bonds.items() if element in ends(bond)}
        if kind_of(element) not in CONSERVING:
            continue
        net = sum(b.power * (1 if ends(bond)[1] == element else -1) for bond, b in own.items())
        assert abs(float(net)) <= 1e-12 * largest, element
        if kind_of(element) == "0":
            efforts = [np.broadcast_to(b.effort, np.shape(b.flow)) for b in own.values()]
            assert all(np.allclose(e, efforts[0], rtol=1e-13) for e in efforts), element


@pytest.mark.parametrize("name", cases(LAWS, long=["PronyBushing"]))
def test_the_port_has_the_effort_of_the_law(name):
    law, x, v, t = arguments(*LAWS[name])
    flow, effort = flow_and_effort(law, x, v, t)
    net = 0.0
    for bond, b in law.bonds(*x, *v, t).items():
        tail, head = ends(bond)
        if PORT in (tail, head):
            part = np.asarray(b.effort)
            part = part if part.shape == effort.shape else part.sum()
            net = net + (part if head == PORT else -part)
            np.testing.assert_allclose(b.flow, np.broadcast_to(flow, np.shape(b.flow)), rtol=1e-14)
    np.testing.assert_allclose(net, effort, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", cases(LAWS, long=["PronyBushing"]))
def test_supply_is_heat_stored_energy_and_work(name):
    law, x, v, t = arguments(*LAWS[name])
    flow, effort = flow_and_effort(law, x, v, t)
    sums, mechanical = bond_sums(law.bonds(*x, *v, t)), float(jnp.sum(effort * flow))
    if len(v) == 1:
        stored = float(jax.grad(law.potential)(x[0], t) * v[0])
    else:
        spin = jnp.array([[0, -v[0][2], v[0][1]], [v[0][2], 0, -v[0][0]], [-v[0][1], v[0][0], 0]])
        stored = float(jax.jvp(lambda *x: law.potential(*x, t), x, (spin @ x[0], v[1]))[1])
    if hasattr(law, "s"):
        rates = jax.tree.map(jnp.asarray, law.rate(*x, *v, t))
        law = type(law)(law.law, jax.tree.map(jnp.asarray, law.s))
        stored += float(law.state_power(x, rates, t))
    given = float(sums.supplied + sums.exchanged)
    size = abs(given) + abs(mechanical) + abs(stored) + abs(float(sums.dissipated))
    assert abs(given - mechanical - stored - float(sums.dissipated)) < 1e-12 * size
    np.testing.assert_allclose(sums.stored, stored, rtol=1e-10, atol=1e-12 * size)
    assert float(sums.dissipated) >= 0.0


def test_a_name_must_be_that_of_a_bond():
    for name in ("voltage", "Se:u", "Q:u -> 1:i", "Se:u - 1:i"):
        with pytest.raises(ValueError, match="kind:name"):
            ends(name)
