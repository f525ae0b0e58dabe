"""Steady turns, step and sine steer, lane change, brake in a turn; the car in space that is the plane one."""

import jax
import numpy as np
import pytest
import scipy.linalg
from scipy.optimize import minimize_scalar

import jaxmbs as mbs
from jaxmbs import vehicles

from .tyres import COEFFICIENTS, VERTICAL

TYRE = vehicles.MagicFormula(COEFFICIENTS, "5.2")
CAR = vehicles.SingleTrack(1093.3, 1791.6, 1.1562, 1.4227, TYRE, TYRE)  # of case VH1
PURE = dict.fromkeys("QDZ1 QDZ2 QDZ3 QDZ4 QDZ6 QDZ7 QDZ8 QDZ9 SSZ1 SSZ2 SSZ3 SSZ4".split(), 0.0)
FREE = dict.fromkeys("PHX1 PHX2 PVX1 PVX2 PHY1 PHY2 PVY1 PVY2 QSX1 QSX2 QSX3 QSY1 QSY2 PHY3 PVY3 PVY4".split(), 0.0)


@pytest.mark.long
def test_steady_turns():
    """Understeer of slow turns in closed form; balance of a fast one, and its slopes, by the mechanism in time."""
    turn = mbs.jit(CAR.steady_turn)
    np.testing.assert_allclose(turn(25.0, 1e-4).understeer, CAR.understeer_gradient(), rtol=1e-3)
    at = turn(25.0, 5.0)
    h = 1e-4
    near = [float(turn(25.0, 5.0 + s).steer) for s in (h, -h)]
    np.testing.assert_allclose(at.understeer, (near[0] - near[1]) / (2 * h) - CAR.wheelbase / 25.0**2, rtol=1e-5)
    assert at.understeer > 1.5 * CAR.understeer_gradient()
    system = CAR.builder(25.0, at.steer).build()
    start = mbs.State.at(system, velocities={"car": [25.0, 25.0 * at.side_slip, at.yaw_rate]})
    after = mbs.simulate(system, start, ts=np.array([0.0, 3.0]), rtol=1e-10).states.velocities[-1]
    np.testing.assert_allclose(after[2], at.yaw_rate, rtol=1e-7)
    assert np.isnan(turn(25.0, 15.0).steer)
    heavy = lambda m: vehicles.SingleTrack(m, 1791.6, 1.1562, 1.4227, TYRE, TYRE).steady_turn(25.0, 5.0).steer
    slope, ends = mbs.jit(jax.grad(heavy)), [float(heavy(1093.3 + s)) for s in (1, -1)]
    np.testing.assert_allclose(slope(1093.3), (ends[0] - ends[1]) / 2, rtol=1e-5)


def test_step_response_of_a_linear_car():
    """Peak, overshoot and response time against the matrix exponential."""
    A, B = np.array([[-4.0, -28.0], [0.9, -4.5]]), np.array([60.0, 35.0])
    whole = np.block([[A, B[:, None]], [np.zeros((1, 3))]])
    rate = lambda t: 0.02 * scipy.linalg.expm(whole * t)[1, 2]
    t = np.linspace(0.0, 4.0, 801)
    found = vehicles.step_steer_response(t, [-rate(x) for x in t], -0.02)
    steady = -0.02 * np.linalg.solve(A, B)[1]
    best = minimize_scalar(lambda x: -rate(x), bounds=(0.05, 1.5), method="bounded", options={"xatol": 1e-10})
    np.testing.assert_allclose([found.steady, found.gain], [-steady, steady / 0.02], rtol=1e-5)
    np.testing.assert_allclose([-found.peak, found.peak_time], [-best.fun, best.x], rtol=1e-4)
    np.testing.assert_allclose(found.overshoot, -best.fun / steady - 1, rtol=1e-3)
    np.testing.assert_allclose(rate(float(found.response_time)), 0.9 * steady, rtol=1e-4)


def test_sine_response_and_slopes():
    t = np.linspace(0.0, 2.0, 201)
    found = vehicles.sine_steer_response(t, 0.1 * np.sin(np.pi * t), 0.3 + 0.05 * np.sin(np.pi * t - 0.4), 0.5)
    np.testing.assert_allclose([found.gain, found.phase], [0.5, -0.4], rtol=2e-3)
    a = np.array([0.0, 0.5, 1.5, 3.0, 4.0])
    np.testing.assert_allclose(vehicles.slopes_over(a, 2.0 + a - 0.1 * a**2), 1.0 - 0.2 * a, atol=1e-12)


def test_brake_in_turn():
    t = np.linspace(0.0, 3.0, 301)
    speed = 20.0 - 5.0 * np.maximum(t - 1.0, 0.0)
    yaw = speed / 50.0 * (1.0 + 0.1 * np.maximum(t - 1.0, 0.0))
    found = vehicles.brake_in_turn(t, yaw, speed, -0.01 * t, 50.0, 1.0)
    np.testing.assert_allclose(jax.tree.leaves(found), [1.1, 1.2, 0.03], rtol=1e-9)
    with pytest.raises(mbs.ModelError, match="histories"):
        vehicles.brake_in_turn(t, yaw[:-1], speed, yaw, 50.0, 1.0)


@pytest.mark.long
def test_double_lane_change_by_a_follower():
    """The rear axle within a decimetre at walking pace; all corners inside of the lanes at 22 m/s."""
    course = vehicles.LaneChange(width=1.7, start=20.0)
    for speed, preview, gain in ((6.0, 4.0, 1.0), (22.0, 12.0, 1.5)):
        b = CAR.builder(speed, 0.0)
        b.measure("x", on=("car", (-1.4227, 0.0, 0.0)), axis="x")
        b.measure("y", on=("car", (-1.4227, 0.0, 0.0)), axis="y")
        b.measure("heading", lambda at: at.coordinates["car"][2])
        driver = vehicles.PathFollower(course, 2.5789, preview, gain)
        b.block("driver", driver, reads=("x", "y", "heading"), drives="front axle.steer")
        system = b.build()
        start = mbs.State.at(system, velocities={"car": [speed, 0.0, 0.0]})
        motion = mbs.simulate(system, start, ts=np.linspace(0.0, 140.0 / speed, 400), rtol=1e-7)
        x, y, angle = np.asarray(motion.states.coordinates).T
        rear = x - 1.4227 * np.cos(angle), y - 1.4227 * np.sin(angle)
        if speed < 10.0:
            assert np.max(np.abs(rear[1] - course(rear[0]))) < 0.1
        corners = [(1.5, 0.85), (1.5, -0.85), (-1.7, 0.85), (-1.7, -0.85)]
        c, s = np.cos(angle), np.sin(angle)
        margins = [course.margin(x + c * p - s * q, y + s * p + c * q) for p, q in corners]
        assert min(map(float, margins)) > 0.0
    assert float(course.margin(np.array([30.0]), np.array([2.0]))) < 0.0


def test_courses_of_public_programs():
    """Lanes of Chrono's ISO3888_Wrapper (its demo of the double lane change), and of Simscape's course."""

    def chrono(lengths, widths, aside):
        """Its definition points: gates from the middle of the entry lane."""
        x = np.cumsum((0.0, *lengths))
        middles = (0.0, aside, (widths[2] - widths[0]) / 2.0)
        gates = zip(x[::2], x[1::2], middles, widths, strict=True)
        return [(a, b, middle - 0.5 * w, middle + 0.5 * w) for a, b, middle, w in gates]

    width = 1.83
    first, second, third = 1.1 * width + 0.25, 1.2 * width + 0.25, 1.3 * width + 0.25
    found = vehicles.LaneChange(width, offset=3.5 + 0.5 * first)
    wanted = chrono((15.0, 30.0, 25.0, 25.0, 30.0), (first, second, third), second / 2.0 + 3.5)
    np.testing.assert_allclose(found.lanes, wanted, rtol=1e-14)
    side = width + 1.0
    found = vehicles.ObstacleAvoidance(width)
    wanted = chrono((12.0, 13.5, 11.0, 12.5, 12.0), (first, side, 3.0), (side + first) / 2.0 + 1.0)
    np.testing.assert_allclose(found.lanes, wanted, rtol=1e-14)
    np.testing.assert_allclose(found.lanes[2].end, 61.0)
    np.testing.assert_allclose(
        found(np.array([0.0, 30.0, 55.0])), [0.0, (side + first) / 2.0 + 1.0, wanted[2][2] + 1.5]
    )
    simscape = vehicles.LaneChange(width, 175.0, 3.5 - 0.05 * width)
    np.testing.assert_allclose(
        [[lane.start, lane.end] for lane in simscape.lanes], [[175, 190], [220, 245], [270, 300]]
    )
    np.testing.assert_allclose(simscape(230.0) - simscape(180.0), 3.5)
    assert vehicles.ObstacleAvoidance(width, -20.0).lanes[0].start == -20.0


CORNERS = ("front left", "front right", "rear left", "rear right")
UPRIGHT, WHEEL, RACK, A, B = 3.0, 3.0, 4.0, 1.1562, 1.4227


def stiff_car(speed, steer):
    """The car of VH1 in space: its mass on the road, upright wheels, no trails, steering axes through them."""
    points = {
        **{"LF": (0.3, 0.3, 0.1), "LR": (-0.3, 0.3, 0.1), "LO": (0.0, 0.75, 0.1)},
        **{"UF": (0.3, 0.3, 0.5), "UR": (-0.3, 0.3, 0.5), "UO": (0.0, 0.75, 0.5)},
        **{"TI": (-0.15, 0.35, 0.3), "TO": (-0.15, 0.75, 0.3), "AI": (0.0, 0.7, 0.3), "AO": (0.0, 0.75, 0.3)},
        "S": (0.0, 0.75, 0.9),
    }
    numbers = COEFFICIENTS | VERTICAL | PURE | FREE | {"VERTICAL_DAMPING": 4000.0}
    formulas = (vehicles.MagicFormula(numbers, "5.2", mirrored=m) for m in (False, True))
    tyres = tuple(vehicles.Tyre(formula, has_relaxation=False) for formula in formulas)
    own, spring = vehicles.double_wishbone(points, 0.3, arms=False), mbs.SpringDamper(1e6, 1e4, 0.8)
    small = ((1e-3, 1e-3, 1e-3), (0.05, 0.05, 0.05))
    axle = lambda x: vehicles.CarAxle(own, (x, 0.0, 0.0), tyres, spring, UPRIGHT, WHEEL, small)
    corner = UPRIGHT + WHEEL
    mass = 1093.3 - 4 * corner - RACK
    com = -(2 * corner * (A - B) + RACK * (A - 0.15)) / mass, 0.0, -0.0365  # all masses together on the road
    rack = -0.15 * np.sin(steer)  # steers both wheels, a parallelogram with levers of 0.15 m behind the axle
    return vehicles.car(axle(A), axle(-B), mass, com, (500.0, 1500.0, 1600.0), rack, speed)


@pytest.mark.long
def test_the_car_in_space_is_the_plane_one():
    """Steady yaw rate after a step of the steer, to 1e-4 of that of the plane car with the same tyres."""
    speed, steer = 25.0, 0.01
    b, _ = stiff_car(speed, steer)
    system = b.build(linear_solver="dense")
    rolling = {"chassis": [speed, 0, 0, 0, 0, 0]}
    for corner in CORNERS:
        rolling |= {f"{corner} float": [speed, 0, 0, 0, 0, 0], f"{corner} spin": speed / 0.33}
    state = mbs.State.at(system, velocities=rolling)
    motion = mbs.simulate(system, state, ts=np.linspace(0.0, 4.0, 9), rtol=1e-6, atol=1e-7, formulation="velocity")
    v = system.velocities(motion.states)
    body, forward = np.asarray(v["chassis"])[-1], np.asarray(mbs.rotation(system, motion, "chassis"))[-1][:, 0]
    ahead = float(body[:3] @ forward)
    tyre = vehicles.MagicFormula(COEFFICIENTS | PURE | FREE, "5.2")
    plane = vehicles.SingleTrack(1093.3, 1791.6, A, B, tyre, tyre)
    flat = plane.builder(ahead, steer).build()
    start = mbs.State.at(flat, velocities={"car": [ahead, 0.0, 0.0]})
    wanted = mbs.simulate(flat, start, ts=np.array([0.0, 4.0]), rtol=1e-9).states.velocities[-1, 2]
    print("yaw rate", body[5], wanted, "speed", ahead)
    np.testing.assert_allclose(body[5], wanted, rtol=1e-4)
