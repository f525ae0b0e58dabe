"""Hydraulic circuits in a system: wiring, closed forms, faults."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import fsolve

import jaxmbs as mbs
from jaxmbs import forces as F
from jaxmbs import hydraulics as H
from jaxmbs.kinematics._configuration import at_state, with_velocities
from jaxmbs.signal_flow._internal_states import internal_rates

AREAS, LEAKAGE, SEALS, WEIGHT = (4e-3, 3e-3), 1e-12, 200.0, 500.0 * 9.81
PUMP, RELIEF = H.Pump(5e-6, 1e-12), H.ReliefValve(1.5e7, 1e-9)
WAYS = {"p": "supply", "t": "tank", "a": "boom.p0", "b": "boom.p1"}


def lift(valve, spool, like=None):
    """A mass on a cylinder that a pump feeds through a valve, with a relief valve beside it."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    b.body("mass", mass=500.0)
    b.joint("slide", mbs.Prismatic("z"), "ground", "mass")
    b.force("boom", F.HydraulicCylinder(AREAS, (1e-3, 1e-3), 1.2e9, leakage=LEAKAGE, damping=SEALS), joint="slide")
    b.measure("height", joint="slide")
    b.hydraulic("tank", H.Tank(1e5))
    b.hydraulic("supply", H.Volume(5e-3, 1.2e9, pressure=1e7))
    b.hydraulic("pump", PUMP, ports={"a": "tank", "b": "supply"}, signal=100.0)
    b.hydraulic("relief", RELIEF, ports={"a": "supply", "b": "tank"})
    if spool == "hold":
        b.block("hold", mbs.blocks.Function(lambda u, t: 20.0 * (0.02 - u)), reads="height")
    b.hydraulic("valve", valve, ports=WAYS, signal=spool)
    return b.build(like=like)


def rates_of(system, state):
    at = with_velocities(system, at_state(system, state), state.velocities)
    found = internal_rates(system, at)
    return {name: float(x) for name, x in zip(state.internal.entries, found, strict=True)}


@pytest.mark.long
def test_flows_are_summed_into_the_nodes():
    valve = H.Valve(5e-4, 3.5e6)
    system = lift(valve, lambda t: 0.5 + t)
    given = {"supply.p": 1.6e7, "boom.p0": 6e6, "boom.p1": 2e6}
    state = mbs.State.at(system, slide=0.1, velocities={"slide": 0.2}, internal=given, t=0.1)
    p, t, a, b = np.asarray(valve.flows(jnp.array([1.6e7, 1e5, 6e6, 2e6]), 0.6))
    found = rates_of(system, state)
    past = LEAKAGE * 4e6
    into_supply = PUMP.flow(1e5 - 1.6e7, 100.0) - RELIEF.flow(1.59e7) + p
    np.testing.assert_allclose(found["supply.p"], into_supply * 1.2e9 / 5e-3, rtol=1e-9)
    np.testing.assert_allclose(found["boom.p0"], (a - 4e-3 * 0.2 - past) * 1.2e9 / 1e-3, rtol=1e-9)
    np.testing.assert_allclose(found["boom.p1"], (b + 3e-3 * 0.2 + past) * 1.2e9 / 1e-3, rtol=1e-9)
    assert mbs.State.at(system).internal["supply.p"] == 1e7


def steady_lift(rated_flow, spool):
    """(supply, p0, p1, speed) of the steady lift, by the balance of flows and forces."""

    def edge(drop):
        return rated_flow * spool * np.sign(drop) * np.sqrt(abs(drop) / 3.5e6)

    def balance(z):
        (p, p0, p1), v = z[:3] * 1e6, z[3]
        past = LEAKAGE * (p0 - p1)
        supply = 5e-6 * 100.0 - 1e-12 * (p - 1e5) - 1e-9 * max(p - 1e5 - 1.5e7, 0.0) - edge(p - p0)
        chambers = edge(p - p0) - AREAS[0] * v - past, -edge(p1 - 1e5) + AREAS[1] * v + past
        force = AREAS[0] * p0 - AREAS[1] * p1 - SEALS * v - WEIGHT
        return np.array([1e6 * supply, *(1e6 * q for q in chambers), 1e-3 * force])

    return fsolve(balance, [15.0, 5.0, 5.0, 0.1], xtol=1e-12)


@pytest.mark.long
def test_a_steady_lift_balances_flows_and_forces():
    system = lift(H.Valve(5e-4, 3.5e6, laminar=1e2), 0.5)
    motion = mbs.simulate(system, mbs.State.at(system), t1=2.0, ts=np.array([0.0, 2.0]), rtol=1e-8, atol=1e-8)
    assert motion.ok
    found = [motion.internal(name)[-1] / 1e6 for name in ("supply.p", "boom.p0", "boom.p1")]
    np.testing.assert_allclose([*found, motion.states.velocities[-1, 0]], steady_lift(5e-4, 0.5), rtol=1e-5)


@pytest.mark.long
def test_slopes_by_numbers_of_the_circuit():
    """Of the height at the end, with the valve led by a block, against differences."""
    first = lift(H.Valve(5e-4, 3.5e6), "hold")

    def height(valve):
        system = lift(valve, "hold", like=first)
        ts = np.array([0.0, 0.3])
        motion = mbs.simulate(system, mbs.State.at(system), t1=0.3, ts=ts, rtol=1e-10, atol=1e-10)
        return 1e3 * motion.states.coordinates[-1, 0]

    value, valve = mbs.jit(height), H.Valve(5e-4, 3.5e6)
    slopes = mbs.jit(jax.grad(height))(valve)
    for name, step in (("rated_flow", 1e-8), ("rated_drop", 1e2), ("overlap", 1e-5)):
        moved = [value(H.Valve(**(vars(valve) | {name: getattr(valve, name) + s * step}))) for s in (1, -1)]
        np.testing.assert_allclose(getattr(slopes, name), (moved[0] - moved[1]) / (2 * step), rtol=1e-4)


def alone():
    """A builder with a body that does not matter."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("mass", mass=1.0)
    b.joint("slide", mbs.Prismatic("z"), "ground", "mass")
    return b


@pytest.mark.long
def test_a_pump_charges_an_accumulator_by_the_polytropic_law():
    """The gas gives way to the oil that the pump delivers."""
    gas = H.Accumulator(2e-3, 5e6, exponent=1.2, pressure=5.02e6, dead_volume=1e-9)
    b = alone()
    b.hydraulic("tank", H.Tank())
    b.hydraulic("gas", gas)
    b.hydraulic("pump", H.Pump(1e-6), ports={"a": "tank", "b": "gas"}, signal=mbs.Harmonic(100.0, 0.0))
    system = b.build()
    ts = np.array([0.0, 4.0, 8.0])
    motion = mbs.simulate(system, mbs.State.at(system), t1=8.0, ts=ts)
    left = gas.gas_volume(5.02e6) - 1e-4 * ts
    pressure = (5e6 + 101325.0) * (2e-3 / left) ** 1.2 - 101325.0
    np.testing.assert_allclose(motion.internal("gas.p"), pressure, rtol=1e-5)


@pytest.mark.long
def test_a_line_and_volumes_swing_at_their_natural_frequency():
    """Two volumes on a line: `omega^2 = E A (1/V1 + 1/V2) / (rho l)`."""
    line = H.Line(2.0, 0.012, viscosity=1e-8)
    b = alone()
    b.hydraulic("first", H.Volume(1e-3, 1.5e9, pressure=1e4))
    b.hydraulic("second", H.Volume(2e-3, 1.5e9))
    b.hydraulic("line", line, ports={"a": "first", "b": "second"})
    system = b.build()
    period = 2 * np.pi / np.sqrt(1.5e9 * line.area * 1.5e3 / (870.0 * 2.0))
    motion = mbs.simulate(system, mbs.State.at(system), ts=np.linspace(0.0, period, 5), rtol=1e-8, atol=1e-8)
    mean, swing = 1e4 / 3, np.array([1.0, 0.0, -1.0, 0.0, 1.0])
    np.testing.assert_allclose(motion.internal("first.p"), mean + 2 * mean * swing, atol=0.5)
    np.testing.assert_allclose(motion.internal("second.p"), mean - mean * swing, atol=0.5)


def test_faults_come_in_one_report():
    b = alone()
    b.force("boom", F.HydraulicCylinder(AREAS, (1e-3, 1e-3), 1.2e9, 0.5, 1e-6, 1e7), joint="slide")
    b.hydraulic("tank", H.Tank())
    b.hydraulic("other tank", H.Tank(1e5), ports={"a": "tank"}, signal=1.0)
    b.hydraulic("lonely", H.Volume(1e-3))
    b.hydraulic("bad", H.Volume(-1e-3))
    b.hydraulic("valve", H.Valve(1e-3, 1e6), ports={"p": "bad", "t": "tank", "a": "boom.p0", "c": "boom.p2"})
    b.hydraulic("gap", H.Orifice(1e-6), ports={"a": "tank", "b": "other tank"})
    b.hydraulic("circle", H.Orifice(1e-6), ports={"a": "bad", "b": "bad"})
    b.hydraulic("relief", H.ReliefValve(1e7, 1e-9), ports={"a": "bad", "b": "tank"}, signal=1.0)
    b.hydraulic("loose", H.Orifice(1e-6))
    b.hydraulic("strange", F.SpringDamper(1.0))
    b.hydraulic("tank", H.Tank())
    b.measure("gap", joint="slide")
    expected = [
        "hydraulic 'tank': the name is taken",
        "hydraulic 'gap': a measure has this name",
        "'other tank': it is a node and has no ports",
        "'other tank': a node takes no signal",
        "'lonely': no port of an element is joined to it",
        "'bad': volume must be positive",
        "'valve': there is no port 'c'",
        "'valve': port 'b' is open",
        "'valve': port 'c': there is no node 'boom.p2'",
        "'valve': a Valve needs a signal",
        "'gap': it joins tanks alone (other tank, tank)",
        "'circle': all its ports are joined to 'bad'",
        "'relief': a ReliefValve takes no signal",
        "'loose': ports must be a dict of nodes by port",
        "'strange': expected an element of jaxmbs.hydraulics",
        "force 'boom': a cylinder in a circuit has no valve of its own",
    ]
    with pytest.raises(mbs.ModelError) as caught:
        b.build()
    for part in expected:
        assert part in str(caught.value), part
    assert len(caught.value.faults) == len(expected)


def test_a_signal_has_a_name_and_one_number():
    b = alone()
    b.hydraulic("one", H.Volume(1e-3))
    b.hydraulic("two", H.Volume(1e-3))
    b.hydraulic("slit", H.Orifice(1e-6), ports={"a": "one", "b": "two"}, signal="speeed")
    b.measure("speed", joint="slide", of="velocity")
    with pytest.raises(mbs.ModelError, match="did you mean 'speed'"):
        b.build()
    b.declared.hydraulics["slit"].signal = np.ones(2)
    with pytest.raises(mbs.ModelError, match="its signal is one number, got 2"):
        b.build()
