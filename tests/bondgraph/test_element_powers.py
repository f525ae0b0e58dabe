"""Powers of elements with states: the balance of each, the energy account of the motion, the bond graph inside."""

import jax
import numpy as np
import pytest
from scipy.integrate import simpson

import jaxmbs as mbs
from jaxmbs import forces as F
from jaxmbs.bondgraph import bond_graph, bond_powers, element_powers, junction_residual

TIMES = np.linspace(0.002, 0.4, 200)
SLIDE = mbs.Prismatic("x")
# its pressures stay between 0.7 and 5.7 bar: oil that is drawn below -1 bar turns to vapour, which ends the motion
CYLINDER = dict(flow_gain=2e-8, supply=7e5, tank=4e5, leakage=1e-11, damping=3.0, length=0.5, varying=True)


def at(states, k):
    return jax.tree.map(lambda x: x[k], states)


def bench():
    """A carriage on every element with states, a motor on a wheel that it rolls, and a mount."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    b.body("carriage", mass=3.0, inertia=(0.1, 0.1, 0.1))
    b.body("table", mass=1.0, inertia=(0.02, 0.02, 0.02))
    b.body("wheel", mass=1.0, inertia=0.02)
    b.joint("slide", SLIDE, "ground", "carriage")
    b.joint("float", mbs.Free(), "carriage", "table")
    b.joint("turn", mbs.Revolute("z"), "ground", "wheel")
    wall = (("ground", (-0.5, 0.0, 0.0)), "carriage")
    for name, law in {
        "maxwell": F.Maxwell(300.0, 20.0),
        "zener": F.Zener(100.0, 20.0, 50.0, 0.4),
        "rubber": F.Prony(20.0, [30.0, 10.0], [0.02, 0.3], 0.45),
        "boom": F.HydraulicCylinder((4e-4, 3e-4), (2e-4, 3e-4), 1e7, 0.7, **CYLINDER),
        "air": F.AirSpring(1e-4, 2e5, 0.3, length=0.5),
    }.items():
        b.force(name, law, between=wall)
    b.force("friction", F.FrictionForce(mbs.friction.LuGre(2.0, 2e3, 5.0, 0.4, 2.6, 0.1)), joint="slide")
    b.force("damper", F.ElastoPlastic(200.0, 4.0, 0.1), joint="slide")
    b.force("spring", mbs.SpringDamper(15.0, 0.7), joint="turn")
    b.force("motor", F.Motor(12.0, 1.5, 0.05, 0.3, 0.32, ratio=2.0, max_torque=1.5), joint="turn")
    stiffness, branches = [800.0] * 3 + [20.0] * 3, [[300.0] * 3 + [5.0] * 3]
    b.force("mount", F.PronyBushing(stiffness, branches, [0.05]), between=("carriage", "table"))
    return b.build()


@pytest.fixture(scope="module")
def moved():
    system = bench()
    velocities = {"slide": 0.8, "turn": -2.0, "float": [0.5, 0.3, -0.4, 0.1, 0.2, -0.1]}
    state = mbs.State.at(system, velocities=velocities)
    return system, mbs.simulate(system, state, ts=TIMES, rtol=1e-9, atol=1e-11)


@pytest.mark.long
def test_every_element_closes(moved):
    powers = element_powers(*moved)
    for name, missing in powers.residual.items():
        parts = (powers.mechanical, powers.stored, powers.dissipated, powers.supplied, powers.exchanged)
        largest = max(float(np.abs(part[name]).max()) for part in parts)
        assert largest > 1e-4 and np.abs(missing).max() < 1e-10 * largest, name
    assert all(np.all(np.asarray(heat) >= -1e-12) for heat in powers.dissipated.values())


@pytest.mark.long
def test_the_energy_account_of_the_motion_agrees(moved):
    system, motion = moved
    powers, work = element_powers(system, motion), motion.diagnostics.work
    for name in powers.names:
        rest = np.asarray(powers.supplied[name] + powers.exchanged[name] - powers.dissipated[name])
        change = np.asarray(work[name])[-1] - np.asarray(work[name])[0]
        gone = simpson(rest, x=TIMES)
        knees = 1e-2 if name in ("damper", "friction", "motor") else 1e-4  # of friction, yield and limits
        assert abs(gone - change) < knees * (simpson(np.abs(rest), x=TIMES) + 1e-9) + 1e-9, name


@pytest.mark.long
@pytest.mark.parametrize("view", ["detailed", "inertia"])
def test_junctions_pass_their_power_on(moved, view):
    """The efforts of the roots follow from the accelerations, so that the bonds' sum must be the element's effort."""
    system, motion = moved
    powers = bond_powers(system, at(motion.states, 20), view)
    largest = max(float(abs(power)) for power in powers.power.values())
    for name, power in junction_residual(powers).items():
        assert abs(float(power)) < 1e-12 * largest, name
    assert abs(float(sum(powers.ports().values()))) < 1e-11 * largest


@pytest.mark.long
def test_domains_and_gradients(moved):
    system, motion = moved
    state = at(motion.states, 20)
    powers = element_powers(system, state)
    current = state.internal["motor.current"]
    voltage = motion_voltage(system, state)
    np.testing.assert_allclose(powers.domain("electric")["motor"], voltage * current, rtol=1e-12)
    assert powers.domain("fluid")["motor"] == 0.0 and powers.domain("fluid")["boom"] == powers.supplied["boom"]
    with pytest.raises(ValueError, match="domain must be"):
        powers.domain("thermal")
    slope = jax.grad(lambda s: element_powers(system, s).dissipated["motor"])(state).internal["motor.current"]
    np.testing.assert_allclose(slope, 2 * 1.5 * current + 0.02 * 2.0 * state.velocities[-1], rtol=1e-12)


@pytest.mark.long
def test_a_motor_on_a_wheel():
    """Its gyrator passes the torque on; the graph inside has an electric side, in integral causality."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("wheel", mass=1.0, inertia=0.02)
    b.joint("turn", mbs.Revolute("z"), "ground", "wheel")
    b.force("motor", F.Motor(12.0, 1.5, 0.05, 0.3, ratio=2.0), joint="turn")
    system = b.build()
    state = mbs.State.at(system, velocities={"turn": 3.0}, internal={"motor.current": 2.5})
    powers, within = bond_powers(system, state), element_powers(system, state)
    assert np.isclose(powers.power["GY:motor.air gap -> rate:motor"], 2.0 * 0.3 * 2.5 * 3.0)
    assert np.isclose(powers.net_power("R:motor.resistance"), 1.5 * 2.5**2)
    assert np.isclose(powers.net_power("Se:motor.voltage"), -12.0 * 2.5)
    assert np.isclose(powers.net_power("I:wheel"), 2.0 * 0.3 * 2.5 * 3.0)
    assert all(abs(float(x)) < 1e-12 for x in junction_residual(powers).values())
    assert abs(float(within.residual["motor"])) < 1e-12 and np.isclose(within.supplied["motor"], 30.0)
    graph = bond_graph(system, "detailed", state)
    strokes = {bond.name: bond.stroke for bond in graph.bonds if bond.domain == "electric"}
    assert strokes == {
        "Se:motor.voltage -> 1:motor.current": "head",
        "1:motor.current -> R:motor.resistance": "tail",
        "1:motor.current -> I:motor.inductance": "head",
        "1:motor.current -> GY:motor.air gap": "tail",
    }
    assert graph["I:motor.inductance"].domain == "electric" and "electric" in graph.describe()


def motion_voltage(system, state):
    assert system.topology.joint_names[-1] == "turn"
    law = next(group.law for group in system.forces if "motor" in group.names)
    law = jax.tree.map(lambda x: x[0], law)
    return law.voltage_at(state.velocities[-1], {"current": state.internal["motor.current"]}, state.t)
