"""Vehicles: a tyre with slopes, a car and its gradient, a rig with all hardpoints, quarter cars on a road.

Times are CPU seconds of compiled programs; a tyre is timed inside of a scan of 100 000 evaluations whose slips follow
each other, less an empty scan.  Quarter cars are beside SciPy's DOP853 of the same equations, one design after
another.
"""

import json
import time
from pathlib import Path

import common  # first: it sets what JAX and NumPy read
import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from scipy.integrate import ode
from scipy.interpolate import CubicSpline

import jaxmbs as mbs
from jaxmbs import vehicles

CASE = Path(__file__).parent.parent / "tests" / "cases" / "TY1_pac2002_tyre.json"
NUMBERS = {n: x for n, x in json.loads(CASE.read_text())["parameters"].items() if not isinstance(x, str)}
NUMBERS["UNLOADED_RADIUS"] = NUMBERS.pop("R0")
NUMBERS |= {
    "VERTICAL_STIFFNESS": 2e5,
    "VERTICAL_DAMPING": 500.0,
    "BREFF": 8.0,
    "DREFF": 0.24,
    "FREFF": 0.01,
    "QSY1": 0.01,
}
POINTS = {
    **{"LF": (0.20, 0.35, 0.20), "LR": (-0.20, 0.35, 0.20), "LO": (0.0, 0.72, 0.18)},
    **{"UF": (0.15, 0.40, 0.50), "UR": (-0.15, 0.40, 0.50), "UO": (-0.02, 0.68, 0.50)},
    **{"TI": (-0.12, 0.35, 0.25), "TO": (-0.14, 0.70, 0.245)},
    **{"AI": (0.0, 0.65, 0.325), "AO": (0.0, 0.76, 0.325), "S": (0.0, 0.55, 0.75)},
}
CORNERS = ("front left", "front right", "rear left", "rear right")
SPEED = 20.0


def tyre(options):
    """Microseconds of all forces and moments, alone and with slopes by slip, slip angle, camber and load."""
    tyre = vehicles.Tyre(vehicles.MagicFormula(NUMBERS, "5.2"))
    count = 10_000 if options.quick else 100_000

    def forces(own, x):
        return jnp.stack(own.forces(x[3], x[0], x[1], x[2]))

    def both(own, x):
        found, push = jax.linearize(lambda x: forces(own, x), x)
        return found, jax.vmap(push)(jnp.eye(4))

    def scan(step):
        def run(own, x):
            return lax.scan(lambda x, _: (x + 1e-18 * step(own, x), None), x, None, length=count)[0]

        return jax.jit(run)

    x = jnp.array([0.03, 0.04, 0.02, 4000.0])
    empty = scan(lambda own, x: x)
    all_of = scan(lambda own, x: sum(map(jnp.sum, both(own, x))) * x)
    alone = scan(lambda own, x: jnp.sum(forces(own, x)) * x)
    known = jax.jit(lambda x: all_of(tyre, x))
    runs = {
        "empty": lambda: empty(tyre, x),
        "forces": lambda: alone(tyre, x),
        "forces and slopes": lambda: all_of(tyre, x),
        "forces and slopes, known coefficients": lambda: known(x),
    }
    times = common.cpu_seconds(runs, 1 if options.quick else 5)
    for name in list(runs)[1:]:
        goal = "2 us" if "slopes" in name else ""
        yield common.row("PAC2002", name, 1e6 * (times[name] - times["empty"]) / count, "us CPU", goal=goal)


def car_of(numbers, like=None):
    """Ten bodies on four tyres with 20 numbers of springs, dampers, masses and tyres, and its state at a speed."""
    spring = lambda k: mbs.SpringDamper(numbers[k], numbers[k + 1], numbers[k + 2])
    scaled = lambda k, m: vehicles.MagicFormula(
        NUMBERS | {n: NUMBERS[n] * numbers[k + i] for i, n in enumerate(("PKY1", "PDY1", "PKX1", "PCY1"))},
        "5.2",
        mirrored=m,
    )
    tyres = lambda k: tuple(vehicles.Tyre(scaled(k, m)) for m in (False, True))
    own = vehicles.double_wishbone(POINTS, 0.325, arms=False)
    axle = lambda x, k, t: vehicles.CarAxle(own, (x, 0.0, 0.0), tyres(t), spring(k), numbers[14], numbers[15])
    inertia = jnp.stack([numbers[17], 1500.0 + 0.0 * numbers[17], numbers[18]])
    rack = mbs.forces.Step(0.5, 0.1, 0.0, 0.004)
    com = jnp.stack([0.0 * numbers[19], 0.0 * numbers[19], numbers[19]])
    b, _ = vehicles.car(axle(1.2, 0, 6), axle(-1.4, 3, 10), numbers[16], com, inertia, rack, SPEED)
    return b.build(like=like, linear_solver="dense")


START = jnp.array([45e3, 3e3, 0.68, 42e3, 2.8e3, 0.68, *[1.0] * 8, 20.0, 20.0, 1000.0, 350.0, 1700.0, 0.55])


def car(options):
    """Step steer of 4 s at 20 m/s: the motion, and the gradient of a mean square yaw rate by 20 numbers."""
    like = car_of(START)
    rolling = {"chassis": [SPEED, 0, 0, 0, 0, 0]}
    for corner in CORNERS:
        rolling |= {f"{corner} float": [SPEED, 0, 0, 0, 0, 0], f"{corner} spin": SPEED / 0.33}
    ts = np.linspace(0.0, 0.5 if options.quick else 4.0, 21)
    how = {"rtol": 1e-4, "atol": 1e-5, "solver": diffrax.Tsit5(), "formulation": "velocity", "interpolate": True}

    def yaw(numbers):
        system = car_of(numbers, like)
        state = mbs.State.at(system, velocities=rolling)
        motion = mbs.simulate(system, state, ts=ts, throw=False, max_steps=2000, **how)
        return jnp.mean(system.velocities(motion.states)["chassis"][:, 5] ** 2)

    runs, built = {}, {}
    for name, function in (("motion", yaw), ("gradient", jax.value_and_grad(yaw))):
        program, built[name] = common.compiled(function, START)
        runs[name] = lambda program=program: program(START)
        assert np.all(np.isfinite(np.concatenate([np.ravel(x) for x in jax.tree.leaves(program(START))]))), name
    times = common.cpu_seconds(runs, 1 if options.quick else 3)
    yield common.row("car, step steer of 4 s", "motion", times["motion"], "s CPU", goal="0.15 s")
    yield common.row(
        "car, step steer of 4 s",
        "gradient by 20 numbers",
        times["gradient"],
        "s CPU",
        "motion",
        times["motion"],
        "0.45 s",
    )
    for name, seconds in built.items():
        yield common.row("car, step steer of 4 s", f"compiling, {name}", seconds, "s CPU")


def rig(options):
    """Poses of 41 travels and 41 racks with the gradient of a mean square of the toe by all hardpoints."""
    own = vehicles.kc_rig(vehicles.double_wishbone(POINTS, 0.325, arms=False))
    side = 5 if options.quick else 41
    travel, rack = np.meshgrid(np.linspace(-0.06, 0.06, side), np.linspace(-0.02, 0.02, side), indexing="ij")
    toe = lambda H: jnp.mean(own.curves(travel, rack, hardpoints=H).toe ** 2)
    program, _ = common.compiled(jax.value_and_grad(toe), own.suspension.hardpoints)
    times = common.cpu_seconds({"rig": lambda: program(own.suspension.hardpoints)}, 1 if options.quick else 3)
    yield common.row(f"rig, {side} x {side} poses", "curves and gradient", times["rig"], "s CPU", goal="1.5 s")


def quarter_cars(options):
    """Designs of a quarter car over 10 s of road at 20 m/s; SciPy's DOP853 on some of them.

    The road's spline has a new cubic every 5 ms.  Steps that land there are smooth; those of a controller stumble at
    every one, and half of them are tried again.
    """
    count, few = (100, 1) if options.quick else (10_000, 5)
    x = np.arange(0.0, 201.0, 0.1)
    height = np.asarray(vehicles.RandomRoad.of_class("C").filtered_profile(x, jax.random.PRNGKey(0)))
    h = mbs.forces.Spline(x / SPEED, height)

    def quarter(k, c, like=None):
        b = mbs.SystemBuilder(gravity=(0, 0, 0))
        for name, mass in (("plate", 1.0), ("wheel", 45.0), ("body", 380.0)):
            b.body(name, mass=mass)
        b.joint("road", mbs.Prismatic("z"), "ground", "plate", drive=h)
        b.joint("tyre", mbs.Prismatic("z"), "plate", "wheel")
        b.joint("strut", mbs.Prismatic("z"), "wheel", "body")
        b.force("tyre", mbs.SpringDamper(stiffness=200e3), joint="tyre")
        b.force("strut", mbs.SpringDamper(stiffness=k, damping=c), joint="strut")
        return b.build(like=like)

    like, ts = quarter(22e3, 1500.0), np.linspace(0.0, 10.0, 101)

    def travel(design):
        system = quarter(*design, like=like)
        motion = mbs.simulate(system, mbs.State.at(system), ts=ts, dt=0.1 / SPEED, solver=diffrax.Tsit5())
        return motion.states.coordinates[:, -1]

    keys = np.random.default_rng(0)
    designs = np.stack([keys.uniform(15e3, 30e3, count), keys.uniform(1e3, 3e3, count)], axis=1)
    mbs.batch(travel, designs, progress=False, compile="full")
    start = time.process_time()
    found = mbs.batch(travel, designs, progress=False, compile="full").values
    ours = (time.process_time() - start) / count
    road = CubicSpline(x / SPEED, height, bc_type="natural")
    begin = np.array([height[0], height[0], road(0.0, 1), road(0.0, 1)])
    start = time.process_time()
    peers = [dop853(road, begin, *design, ts) for design in designs[:few]]
    theirs = (time.process_time() - start) / few
    exact = [dop853(road, begin, *design, ts, rtol=1e-10) for design in designs[:few]]
    strut = lambda rows: rows[:, 1] - rows[:, 0]
    error = max(np.max(np.abs(strut(rows) - own)) for rows, own in zip(exact, np.asarray(found), strict=False))
    peers_error = max(np.max(np.abs(strut(rows) - strut(one))) for rows, one in zip(exact, peers, strict=True))
    case = f"quarter car, {count} designs over 10 s"
    yield common.row(case, "each", ours, "s CPU", "SciPy DOP853 in C", theirs, "0.3")
    yield common.row(case, "largest error of the strut", error, "m", "SciPy DOP853 in C", peers_error)


def dop853(road, begin, k, c, ts, rtol=1e-6):
    """Heights of wheel and body (times, 4) by SciPy's compiled DOP853, with the right side in Python."""

    def rate(t, y):
        strut = k * (y[1] - y[0]) + c * (y[3] - y[2])
        return [y[2], y[3], (strut - 200e3 * (y[0] - road(t))) / 45.0, -strut / 380.0]

    solver = ode(rate).set_integrator("dop853", rtol=rtol, atol=1e-2 * rtol, nsteps=1_000_000)
    solver.set_initial_value(begin, 0.0)
    return np.stack([begin, *(solver.integrate(t) for t in ts[1:])])


CASES = {"tyre": tyre, "car": car, "rig": rig, "quarter cars": quarter_cars}


def main():
    options = common.parser(__doc__, *CASES).parse_args()
    rows = [row for name, case in CASES.items() if common.wanted(options, name) for row in case(options)]
    common.report(rows, options)


if __name__ == "__main__":
    main()
