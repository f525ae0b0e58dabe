"""VH1, VH2: the single-track car: understeer, slopes, poles, gains, step steer; published rates of CommonRoad."""

import json
import re
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

import jaxmbs as mbs
from jaxmbs import vehicles
from tests.vehicles.tyres import COEFFICIENTS

VH1, VH2 = (
    json.loads((Path(__file__).parent / f"{name}.json").read_text())
    for name in ("VH1_single_track_pac2002", "VH2_single_track_commonroad")
)
ROWS = {(row["quantity"], row["time"]): row for row in VH1["outputs"]}


def car(a=1.1562, mass=1093.3, coefficients=None):
    tyre = vehicles.MagicFormula(COEFFICIENTS | (coefficients or {}), "5.2")
    return vehicles.SingleTrack(mass, 1791.6, a, 1.1562 + 1.4227 - a, tyre, tyre)


@mbs.jit
def answers(own):
    """Loads, stiffnesses, lengths (2,) of the axles; understeer gradient and its slopes by all numbers of the car."""
    axles = own.axles()
    of_axles = [jnp.stack([f(x) for x in axles]) for f in (load, stiffness, length)]
    return of_axles, jax.value_and_grad(lambda c: c.understeer_gradient())(own)


load, stiffness, length = (lambda x: x.load), (lambda x: x.cornering_stiffness()), (lambda x: x.relaxation_length())


def closed_forms():
    (loads, stiffnesses, lengths), (gradient, slopes) = answers(car())
    for k, name in enumerate(("front", "rear")):
        yield loads[k] / 2, f"load of a {name} tyre N"
        yield stiffnesses[k], f"cornering stiffness of the {name} axle N/rad"
        yield lengths[k], f"relaxation length of the {name} tyres m"
    yield gradient, "understeer gradient rad s^2/m"
    yield np.sqrt(car().wheelbase / gradient), "characteristic speed m/s"
    other = answers(car(1.35))[1][0]
    yield other, "understeer gradient with a = 1.35 m on the same wheelbase rad s^2/m"
    yield np.sqrt(-car().wheelbase / other), "critical speed with a = 1.35 m m/s"
    yield slopes.a, "d understeer gradient / d a rad s^2/m^2"
    yield slopes.mass, "d understeer gradient / d mass rad s^2/(m kg)"
    for name in ("PKY1", "PKY2", "PDY1"):
        of_both = slopes.front.coefficients[name] + slopes.rear.coefficients[name]
        yield of_both, f"d understeer gradient / d {name}"


@mbs.jit
def linear(own, speed):
    return own.linear(speed), own.linear(speed, has_relaxation=True).A, own.gains(speed)


def linear_rows():
    for speed in (10.0, 20.0, 30.0, 40.0):
        space, _, gains = linear(car(), speed)
        root = np.linalg.eigvals(space.A)[0]
        yield root.real, f"pole at {speed:g} m/s, real part 1/s"
        yield abs(root.imag), f"pole at {speed:g} m/s, imaginary part rad/s"
        yield gains[0], f"yaw rate gain at {speed:g} m/s 1/s"
        yield gains[1], f"gain of the slip angle at the centre of mass at {speed:g} m/s"
    for speed in (10.0, 30.0):
        roots = np.linalg.eigvals(linear(car(), speed)[1])
        for (quantity, _), row in ROWS.items():
            if match := re.match(rf"pole \d with relaxation at {speed:g} m/s, (real|imaginary)", quantity):
                part = roots.real if match[1] == "real" else np.abs(roots.imag)
                yield part[np.argmin(np.abs(part - row["value"]))], quantity
    A, B, _, _ = linear(car(), 25.0)[0]
    for t in (0.1, 0.2, 0.5, 1.0):
        whole = scipy.linalg.expm(np.block([[A, B], [np.zeros((1, 3))]]) * t)
        yield 0.01 * whole[1, 2], ("linear step steer 0.01 rad at 25 m/s: yaw rate rad/s", t)


@pytest.mark.slow
def test_closed_forms_poles_and_gains_of_the_case():
    for found, what in [*closed_forms(), *linear_rows()]:
        row = ROWS[what if isinstance(what, tuple) else (what, None)]
        size = abs(row["value"]) or 1.0
        assert abs(float(found) - row["value"]) <= row["tol"] * size, (what, float(found), row)


@pytest.mark.long
def test_step_steer_of_the_mechanism():
    """Yaw rate and lateral speed to 1e-8, the greatest yaw rate and its time; the linearised mechanism."""
    system = car().builder(25.0, 0.02).build()
    start = mbs.State.at(system, velocities={"car": [25.0, 0.0, 0.0]})
    ts = np.array([0.1, 0.2, 0.5, 1.0, 2.0])
    motion = mbs.simulate(system, start, ts=ts, rtol=1e-12, atol=1e-12)
    x, y, r = np.asarray(motion.states.velocities).T
    angle = np.asarray(motion.states.coordinates)[:, 2]
    lateral = np.cos(angle) * y - np.sin(angle) * x
    for k, t in enumerate(ts):
        for name, found in (("yaw rate rad/s", r[k]), ("lateral speed m/s", lateral[k])):
            row = ROWS[f"step steer 0.02 rad at 25 m/s: {name}", t]
            assert abs(found - row["value"]) <= row["tol"] * abs(row["value"])
    fine = np.linspace(1.0, 1.1, 41)
    rates = np.asarray(mbs.simulate(system, start, ts=fine, rtol=1e-11, atol=1e-11).states.velocities)[:, 2]
    peak = np.poly1d(np.polyfit(fine - 1.04, rates, 6))
    at = min((t.real for t in peak.deriv().roots if abs(t.imag) < 1e-12 and abs(t) < 0.05), key=abs)
    check_row = lambda name, found, size: abs(found - ROWS[name, None]["value"]) <= ROWS[name, None]["tol"] * size
    assert check_row("step steer 0.02 rad at 25 m/s: greatest yaw rate rad/s", peak(at), 0.186)
    assert check_row("step steer 0.02 rad at 25 m/s: time of the greatest yaw rate s", at + 1.04, 1.0)


@pytest.mark.long
@pytest.mark.parametrize("has_relaxation", [False, True])
def test_linearised_mechanism_has_the_poles_of_the_closed_form(has_relaxation):
    system = car().builder(30.0, 0.0, has_relaxation).build()
    state = mbs.State.at(system, velocities={"car": [30.0, 0.0, 0.0]})
    linear = mbs.linearise(system, state, inputs=["front axle.steer"])
    found = np.sort_complex(np.linalg.eigvals(linear.state_space.A))
    wanted = np.sort_complex(np.linalg.eigvals(car().linear(30.0, has_relaxation).A))
    for root in wanted:
        assert np.min(np.abs(found - root)) < 1e-7 * abs(root)


def test_published_rates_of_commonroad():
    """Linear tyres; the acceleration moves load to the rear."""
    p = VH2["parameters"]
    load = p["m"] * p["g"] / 4
    tyre = vehicles.LinearTyre(1.0, p["mu"] * p["C"] * load, nominal_load=load, radius=0.3, stiffness=2e5)
    own = vehicles.SingleTrack(p["m"], p["I"], p["lf"], p["lr"], tyre, tyre, height=p["h"], gravity=p["g"])
    _, _, steer, speed, yaw, yaw_rate, slip = p["state"]
    space = own.linear(speed, acceleration=p["acceleration"])
    lateral, turning = space.A @ jnp.array([slip * speed, yaw_rate]) + space.B[:, 0] * steer
    found = [speed * np.cos(slip + yaw), speed * np.sin(slip + yaw), p["steer_rate"], p["acceleration"]]
    found += [yaw_rate, turning, lateral / speed]
    for value, row in zip(found, VH2["outputs"], strict=True):
        np.testing.assert_allclose(value, row["value"], rtol=0, atol=row["tol"])


@pytest.mark.long
def test_speeds_and_report():
    np.testing.assert_allclose(car().characteristic_speed(), 132.48993441956054, rtol=1e-9)
    assert np.isnan(car().critical_speed()) and "understeer gradient" in str(car())


def test_wrong_cars_are_refused():
    tyre = car().front
    with pytest.raises(TypeError, match=r"tyre\.model"):
        vehicles.SingleTrack(1000.0, 1500.0, 1.2, 1.4, vehicles.Tyre(tyre), tyre)
    with pytest.raises(mbs.ModelError, match="mass must be positive"):
        vehicles.SingleTrack(0.0, 1500.0, 1.2, 1.4, tyre, tyre)
