"""Suspensions, axles, bars and drivelines on a chassis: mobility, and loads against statics written out in NumPy."""

import jax
import numpy as np
import pytest
from scipy.optimize import fsolve

import jaxmbs as mbs
from jaxmbs import vehicles

from .test_suspensions import KINDS, RADIUS, wrench
from .test_suspensions import rig as rig_of

SPRING = mbs.SpringDamper(stiffness=60e3, damping=1e3, free_length=0.62)
LOAD = np.array([-800.0, 600.0, 3000.0])
MIRROR = np.array([1.0, -1.0, 1.0])
FOUR_LINKS = {
    **{"AO": (0.0, 0.75, 0.31), "S": (0.1, 0.5, 0.75), "D": (0.1, 0.52, 0.35)},
    **{"LI": (0.6, 0.5, 0.3), "LO": (0.05, 0.55, 0.25), "RI": (0.6, -0.5, 0.3), "RO": (0.05, -0.55, 0.25)},
    **{"UI": (0.4, 0.45, 0.5), "UO": (0.0, 0.1, 0.52), "VI": (0.4, -0.45, 0.5), "VO": (0.0, -0.1, 0.52)},
}
LINKS = {
    "lower left": ("LI", "LO"),
    "lower right": ("RI", "RO"),
    "upper left": ("UI", "UO"),
    "upper right": ("VI", "VO"),
}


def chassis():
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("chassis", 100.0, inertia=10.0)
    b.joint("chassis", mbs.Weld(), "ground", "chassis")
    return b


def rest(system):
    return mbs.equilibrium(system, mbs.State.at(system)).state


def along(a, b):
    return (b - a) / np.linalg.norm(b - a)


def at(system, state, body, point):
    return np.asarray(mbs.position(system, state, (body, np.asarray(point, float))))


@pytest.mark.long
@pytest.mark.parametrize(("kind", "redundant"), [*zip(KINDS, (2, 0, 0, 0), strict=True)])
def test_a_corner_on_its_spring_carries_what_the_rig_says(kind, redundant):
    """One freedom; two redundant rows of two arms in two balls each.  Loads of the right side are mirror images."""
    own = rig_of(kind).suspension
    loads = []
    for side, sign in (("left", 1.0), ("right", -1.0)):
        b, mirror = chassis(), np.array([1.0, sign, 1.0])
        parts = vehicles.mount_suspension(b, own, "front", "chassis", side, at=(0.3, 0.0, 0.1), spring=SPRING)
        centre = np.asarray(own.hardpoints["AO"]) * mirror + [0.3, 0.0, 0.1]
        b.force("load", mbs.Force(LOAD * mirror), on=(parts.bodies["upright"], centre))
        system = b.build(cut=parts.cut)
        assert (system.topology.mobility, system.topology.analysis.redundant) == (1, redundant)
        state = rest(system)
        found = vehicles.hardpoint_loads(system, state, parts, "chassis")
        loads.append({name: np.asarray(force) * mirror for name, force in found.items()})
        travel = at(system, state, parts.bodies["upright"], centre)[2] - centre[2]
    for name, force in loads[0].items():
        np.testing.assert_allclose(loads[1][name], force, atol=1e-9 * 3e3)
    given = rig_of(kind).loads(LOAD, travel=travel, at="centre")
    for name, force in given.chassis.items():
        np.testing.assert_allclose(loads[0][name], force, atol=1e-9 * 3e3)


@pytest.mark.long
def test_solid_axle_on_four_links():
    """Bounce and roll; tensions of four links and two springs from six equations; springs by virtual work."""
    b = chassis()
    H = {name: np.array(x) for name, x in FOUR_LINKS.items()}
    parts = vehicles.mount_solid_axle(b, H, LINKS, "rear", "chassis", 90.0, (9.0, 1.0, 9.0), SPRING)
    b.force("left wheel", mbs.Force(LOAD), on=("rear axle", H["AO"]))
    b.force("right wheel", mbs.Force((0.0, 0.0, 2000.0)), on=("rear axle", H["AO"] * MIRROR))
    system = b.build()
    assert (system.topology.mobility, system.topology.analysis.redundant) == (2, 0)
    state = rest(system)
    place = lambda point: at(system, state, "rear axle", point)
    whole = wrench(place(H["AO"]), LOAD) + wrench(place(H["AO"] * MIRROR), np.array([0.0, 0.0, 2000.0]))
    columns = [wrench(H[inner], along(place(H[outer]), H[inner])) for inner, outer in LINKS.values()]
    freedoms = np.linalg.svd(np.stack(columns))[2][4:]  # twists (velocity, angular velocity) that no link resists
    for sign in (1.0, -1.0):
        top, foot = H["S"] * [1.0, sign, 1.0], place(H["D"] * [1.0, sign, 1.0])
        columns.append(wrench(top, along(foot, top)))
    found = np.linalg.solve(np.stack(columns, 1), -whole)
    by_work = np.linalg.solve(freedoms @ np.stack(columns[4:], 1), -freedoms @ whole)
    loads = vehicles.hardpoint_loads(system, state, parts, "chassis")
    for k, (inner, _) in enumerate(LINKS.values()):
        np.testing.assert_allclose(loads[inner], found[k] * columns[k][:3], atol=1e-9 * 3e3)
    for k, name in enumerate(("left S", "right S")):
        np.testing.assert_allclose(loads[name], found[4 + k] * columns[4 + k][:3], atol=1e-9 * 3e3)
        np.testing.assert_allclose(by_work[k], found[4 + k], rtol=1e-9)


@pytest.mark.long
def test_twist_beam_in_opposite_travel():
    """Stiffness of the wheels against a beam of twelve freedoms between rigid arms, in NumPy."""
    H = {
        name: np.array(x)
        for name, x in {"P": (0.45, 0.5, 0.3), "B": (0.3, 0.45, 0.29), "AO": (0.0, 0.7, 0.3)}.items()
    }
    E, G, J, I, length = 210e9, 80e9, 2e-7, 4e-7, 0.9
    section = mbs.forces.BeamSection.of_material(E, G, 7850.0, 1e-3, I, 2 * I, torsion=J, shear=None)
    b = chassis()
    parts = vehicles.mount_twist_beam(b, H, section, "rear", "chassis", 15.0, (0.5, 0.5, 0.5))
    force = 1e-3  # so small that the answer is linear
    up = np.array([0.0, 0.0, 1.0])
    for sign, side in ((1.0, "left"), (-1.0, "right")):
        b.force(
            f"{side} wheel",
            mbs.Force(sign * force * up),
            on=(parts.bodies[f"{side} arm"], H["AO"] * [1.0, sign, 1.0]),
        )
    # parallel travel is free: a soft spring holds it
    b.force(
        "soft", mbs.Bushing((0, 0, 1.0, 0, 0, 0)), between=(("chassis", H["AO"]), (parts.bodies["left arm"], H["AO"]))
    )
    system = b.build()
    assert system.topology.mobility == 6
    state = rest(system)
    loads = vehicles.hardpoint_loads(system, state, parts, "chassis")
    K = np.zeros((12, 12))  # x along the beam, right end first
    ea, gj = E * 1e-3 / length, G * J / length
    for i, k in ((0, ea), (3, gj)):
        K[np.ix_([i, i + 6], [i, i + 6])] += k * np.array([[1, -1], [-1, 1]])
    for v, r, s, ei in ((1, 5, 1, 2 * E * I), (2, 4, -1, E * I)):
        a, c, d = 12 * ei / length**3, 6 * ei / length**2, 4 * ei / length
        own = np.array(
            [[a, s * c, -a, s * c], [s * c, d, -s * c, d / 2], [-a, -s * c, a, -s * c], [s * c, d / 2, -s * c, d]]
        )
        K[np.ix_([v, r, v + 6, r + 6], [v, r, v + 6, r + 6])] += own
    R = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # section axes by those of the car
    T = np.zeros((12, 6))
    wheel = np.zeros((2, 6))
    for k, sign in enumerate((-1.0, 1.0)):  # right, left: turns of the arms about their balls
        mirror = np.array([1.0, sign, 1.0])
        for j in range(3):
            turn = np.eye(3)[j]
            T[6 * k : 6 * k + 3, 3 * k + j] = R @ np.cross(turn, (H["B"] - H["P"]) * mirror)
            T[6 * k + 3 : 6 * k + 6, 3 * k + j] = R @ turn
            wheel[k, 3 * k + j] = np.cross(turn, (H["AO"] - H["P"]) * mirror)[2]
    stiffness = T.T @ K @ T + np.outer(wheel[1], wheel[1])
    turns = np.linalg.solve(stiffness, force * (wheel[1] - wheel[0]))
    rises = [
        at(system, state, parts.bodies[f"{side} arm"], H["AO"] * [1.0, sign, 1.0])[2] - 0.3
        for sign, side in ((-1.0, "right"), (1.0, "left"))
    ]
    np.testing.assert_allclose(np.diff(rises), np.diff(wheel @ turns), rtol=1e-7)
    total = sum(np.asarray(x) for x in loads.values())
    np.testing.assert_allclose(total[2], force * (wheel @ turns)[1] / force, atol=1e-9)


@pytest.mark.long
def test_anti_roll_bar_by_its_levers():
    """Two freedoms; twist of the levers, pull of the drop links and both bearings, written out."""
    H = {"M": np.array([0.0, 0.35, 0.3]), "E": np.array([-0.25, 0.40, 0.32]), "L": np.array([-0.24, 0.42, 0.45])}
    b, rises = chassis(), {"left": 0.03, "right": -0.02}
    for side, rise in rises.items():
        b.body(side, 1.0, inertia=0.1)
        b.joint(side, mbs.Prismatic("z"), "ground", side, drive=mbs.forces.Constant(rise))
    parts = vehicles.mount_anti_roll_bar(b, H, 1500.0, "bar", "chassis", "left", "right")
    system = b.build()
    assert (system.topology.mobility, system.topology.analysis.redundant) == (0, 0)
    state = mbs.State.at(system)
    assert state.ok
    loads = vehicles.hardpoint_loads(system, state, parts, "chassis")
    turns, rods = [], []
    turn = lambda q: np.array([[np.cos(q), 0, np.sin(q)], [0, 1, 0], [-np.sin(q), 0, np.cos(q)]])
    for side, sign in (("left", 1.0), ("right", -1.0)):
        M, E, L = (H[name] * [1.0, sign, 1.0] for name in "MEL")
        L = L + [0.0, 0.0, rises[side]]
        end = lambda q, M=M, E=E: M + turn(q) @ (E - M)
        gap = lambda q, end=end, L=L: np.linalg.norm(end(q[0]) - L) - np.linalg.norm(H["E"] - H["L"])
        turns.append(fsolve(gap, 0.0, xtol=1e-13)[0])
        rods.append((end(turns[-1]), along(end(turns[-1]), L), M))
    torque = 1500.0 * (turns[1] - turns[0])  # of the bar on the left lever
    pulls = []
    for (end, line, M), own in zip(rods, (torque, -torque), strict=True):
        pulls.append(-own / np.cross(end - M, line)[1])
    columns = [wrench(M, axis) for _, _, M in rods for axis in np.eye(3)]
    whole = sum(wrench(end, pull * line) for (end, line, _), pull in zip(rods, pulls, strict=True))
    bearings = np.linalg.lstsq(np.stack([*columns[:4], columns[5]], 1), -whole, rcond=None)[0]
    np.testing.assert_allclose(loads["left M"], bearings[:3], atol=1e-9 * np.abs(pulls).max())
    np.testing.assert_allclose(loads["right M"], [bearings[3], 0.0, bearings[4]], atol=1e-9 * np.abs(pulls).max())


@pytest.mark.long
def test_rack_with_column_and_torsion_bar():
    """Moment on the wheel is the rack's force times the pinion's radius; the bar twists by it over its stiffness."""
    b = chassis()
    vehicles.mount_steering(
        b, "front", "chassis", (0.1, 0.0, 0.3), stiffness=80.0, damping=1.0, pinion_radius=0.008, angle=0.5
    )
    b.force("tie rods", mbs.Force((0.0, 900.0, 0.0)), on="front rack")
    system = b.build()
    assert system.topology.mobility == 1
    state = rest(system)
    moment = mbs.reactions(system, state).drive("front steering wheel").effort
    np.testing.assert_allclose(moment, -900.0 * 0.008, rtol=1e-9)
    q = system.coordinates(state)
    np.testing.assert_allclose(q["front torsion bar"], 900.0 * 0.008 / 80.0, rtol=1e-9)
    np.testing.assert_allclose(q["front rack"], 0.008 * (0.5 + 900.0 * 0.008 / 80.0), rtol=1e-9)


@pytest.mark.long
def test_differential_and_brake():
    """Each wheel has ratio / 2 times the torque, whatever their speeds; a brake stops one in I w / T."""
    b = chassis()
    brake = vehicles.BrakeTorque(50.0, slow=1e-3)
    for name, y in (("left", 0.7), ("right", -0.7)):
        stop = brake if name == "left" else None
        vehicles.mount_wheel(b, name, "chassis", (0.0, y, 0.3), 20.0, (0.6, 1.0, 0.6), brake=stop)
    vehicles.mount_differential(b, "rear", "chassis", "left spin", "right spin", ratio=4.0, inertia=0.1)
    b.force("engine", mbs.Actuator(100.0), joint="rear shaft")
    system = b.build()
    assert system.topology.mobility == 2
    speeds = {"left spin": 20.0, "right spin": 10.0, "rear shaft": 60.0}
    state = mbs.State.at(system, velocities=speeds)
    motion = mbs.simulate(system, state, ts=np.array([0.0, 0.1]), rtol=1e-10)
    v = system.velocities(motion.states)
    # I_l a_l + I_s 4 (a_l + a_r) / 2 * 4 / 2 = T - brake, and so on: two equations
    inertia = np.array([[1.0 + 0.4, 0.4], [0.4, 1.0 + 0.4]])
    rates = np.linalg.solve(inertia, [200.0 - 50.0, 200.0])
    found = [v[name][1] - v[name][0] for name in ("left spin", "right spin")]
    np.testing.assert_allclose(found, 0.1 * rates, rtol=1e-8)


def wishbones(x, mirrored=False):
    points = KINDS["double_wishbone"]
    own = vehicles.double_wishbone({name: p for name, p in points.items() if name != "D"}, RADIUS, arms=False)
    tyre = vehicles.LinearTyre(9e4, 6e4, nominal_load=4e3, radius=0.32, stiffness=2e5, vertical_damping=500.0)
    tyres = vehicles.Tyre(tyre), vehicles.Tyre(tyre)
    return vehicles.CarAxle(own, (x, 0.0, 0.0), tyres, mbs.SpringDamper(9e4, 4e3, 0.66))


@pytest.mark.long
def test_a_car_stands_on_its_tyres():
    """Fourteen freedoms; loads of the tyres by the levers of the weights; loads of a corner hold its wheel."""
    b, parts = vehicles.car(wishbones(1.2), wishbones(-1.4), 1000.0, (0.0, 0.0, 0.5), (400.0, 1500.0, 1700.0))
    system = b.build(linear_solver="dense")
    assert (system.topology.mobility, system.topology.analysis.redundant) == (14, 0)
    motion = mbs.simulate(system, mbs.State.at(system), ts=np.array([0.0, 8.0]), rtol=1e-7)
    state = jax.tree.map(lambda x: x[-1], motion.states)
    readings = mbs.dynamics.element_reports(system, state).results
    tyre = {
        name: float(readings[f"{name} tyre"]["load"].value) for name in ("front left", "front right", "rear left")
    }
    np.testing.assert_allclose(tyre["front left"], tyre["front right"], rtol=1e-6)
    np.testing.assert_allclose(tyre["front left"] + tyre["rear left"], 9.81 * (1000.0 + 160.0 + 4.0) / 2, rtol=2e-4)
    loads = vehicles.hardpoint_loads(system, state, parts["front left"], "chassis")
    up = sum(np.asarray(force)[2] for force in loads.values())
    np.testing.assert_allclose(up + tyre["front left"], 9.81 * 40.0, rtol=2e-4)
    assert parts["front left"].points["S"] == ("front left spring",)
