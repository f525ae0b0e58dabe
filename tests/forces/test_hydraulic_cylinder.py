"""A cylinder's flows and volumes; the case HY1 has its motion."""

import jax
import numpy as np

from jaxmbs import forces as F

GIVEN = dict(flow_gain=2e-6, supply=2e7, tank=1e5, leakage=1e-12, length=0.4, varying=True)


def cylinder(valve, **changed):
    return F.HydraulicCylinder((4e-3, 3e-3), (1e-3, 2e-3), 1.5e9, valve, **(GIVEN | changed))


def test_flows_of_the_valve():
    s = {"p0": 5e6, "p1": 2e6}
    out, back = cylinder(0.5).flows(0.4, 0.0, s, 0.0), cylinder(-0.5).flows(0.4, 0.0, s, 0.0)
    np.testing.assert_allclose(out, [0.5 * 2e-6 * np.sqrt(1.5e7), -0.5 * 2e-6 * np.sqrt(1.9e6)], rtol=1e-4)
    np.testing.assert_allclose(back, [-0.5 * 2e-6 * np.sqrt(4.9e6), 0.5 * 2e-6 * np.sqrt(1.8e7)], rtol=1e-4)
    slope = jax.grad(lambda p: cylinder(0.5).flows(0.4, 0.0, {"p0": p, "p1": 2e6}, 0.0)[0])(2e7)
    np.testing.assert_allclose(slope, -0.5 * 2e-6 / np.sqrt(1e4))  # finite without a pressure difference


def test_a_closed_valve_is_a_stiff_spring_of_oil():
    """Its pressures rise by `E A / V` of the way, in chambers that move with the piston."""
    law = cylinder(0.0, leakage=0.0)
    rates = law.rate(0.45, 0.1, {"p0": 1e6, "p1": 1e6}, 0.0)
    volumes = 1e-3 + 4e-3 * 0.05, 2e-3 - 3e-3 * 0.05
    np.testing.assert_allclose(rates["p0"], -1.5e9 * 4e-3 * 0.1 / volumes[0])
    np.testing.assert_allclose(rates["p1"], 1.5e9 * 3e-3 * 0.1 / volumes[1])


def test_it_starts_at_the_tanks_pressure_and_opens_by_a_function():
    law = cylinder(lambda x, v, t: 0.1 * t - x)
    assert law.start(0.4, 0.0, 0.0)["p0"] == 1e5
    s = {"p0": 5e6, "p1": 2e6}
    np.testing.assert_allclose(law.flows(0.1, 0.0, s, 3.0), cylinder(0.2).flows(0.1, 0.0, s, 0.0))
    np.testing.assert_allclose(cylinder(F.Ramp(0.0, 0.1)).flows(0.1, 0.0, s, 2.0), law.flows(0.1, 0.0, s, 3.0))


def test_faults():
    assert "two chambers" in F.HydraulicCylinder([1.0], [1.0], 1.0, 0.0, 1.0, 1.0).faults()[0]
    assert len(cylinder(0.0, supply=0.0, leakage=-1.0, laminar=0.0).faults()) == 3


def test_flows_given_in_place_of_a_valve():
    law = F.HydraulicCylinder((4e-3, 3e-3), (1e-3, 2e-3), 1.5e9, inflow=lambda t: np.array([2e-5, -1e-5]) * t)
    rates = law.rate(0.4, 0.1, {"p0": 1e6, "p1": 1e6}, 3.0)
    np.testing.assert_allclose(rates["p0"], 1.5e9 * (6e-5 - 4e-3 * 0.1) / 1e-3)
    np.testing.assert_allclose(rates["p1"], 1.5e9 * (-3e-5 + 3e-3 * 0.1) / 2e-3)
    shut = F.HydraulicCylinder((4e-3, 3e-3), (1e-3, 2e-3), 1.5e9, tank=1e5)
    assert not shut.faults() and not np.any(shut.flows(0.4, 0.1, {"p0": 5e6, "p1": 1e5}, 0.0))
    assert "no valve of its own" in cylinder(0.0, inflow=(0.0, 0.0)).faults()[0]
