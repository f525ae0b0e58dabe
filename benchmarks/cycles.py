"""Costs of cycles beside those of one period's motion, and of harmonic balance, in CPU seconds."""

import os
import time

os.environ.setdefault("JAXMBS_COMPILE", "tape")  # what runs compiled says so itself
import common
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs
from jaxmbs import rotors


def slider_crank(d, like=None):
    """A slider-crank under a motor; d: ten dimensions and masses."""
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    b.body("crank", d[0], (d[1], 0.0, 0.0), (d[2],) * 3)
    b.body("rod", d[3], (d[4], 0.0, 0.0), (d[5],) * 3)
    b.body("slider", d[6], inertia=(0.01, 0.01, 0.01))
    pin = mbs.Revolute("z")
    b.joint("main", pin, "ground", "crank")
    b.joint("crank pin", pin, "crank", "rod", parent_frame=(d[7], 0.0, 0.0))
    b.joint("wrist", pin, "rod", "slider", parent_frame=(d[8], 0.0, 0.0))
    b.joint("slide", mbs.Prismatic("x"), "ground", "slider")
    b.force("motor", mbs.Actuator(Motor(d[9])), joint="main")
    return b.build(cut=("wrist",), like=like)


class Motor(eqx.Module):
    """A motor that slackens with the speed."""

    slope: jax.Array

    def __call__(self, angle, speed, t):
        return self.slope * (20.0 - speed)


KINDS = {"on tapes": "tape", "compiled": "full"}
DIMENSIONS = np.array([1.2, 0.075, 0.004, 2.0, 0.25, 0.06, 3.0, 0.15, 0.5, 8.0])


def first_cycle(like):
    """The cycle of the machine of `DIMENSIONS`."""
    start = mbs.State.at(like, velocities={"main": 20.0}, guess={"main": 0.0, "slide": 0.65})
    ask = lambda system: mbs.periodic(
        system, 2.0 * np.pi / 20.0, start, free="period", turns={"main": 1}, throw=False
    )
    return mbs.jit(ask, compile="tape")(like)


def crank(quick, how="on tapes"):
    """A slider-crank's cycle with all pin loads, and its gradient by ten dimensions, over one period's motion."""
    like = slider_crank(jnp.asarray(DIMENSIONS))
    first = first_cycle(like)
    near, period = first[0], first.period

    def peak(d):
        system = slider_crank(d, like)
        cycle = mbs.periodic(system, period, near, free="period", turns={"main": 1}, throw=False)
        loads = mbs.reactions(system, cycle)
        return sum(jnp.sum(loads[name].force ** 2) for name in loads)

    ts = jnp.linspace(0.0, period, 121)
    d = jnp.asarray(DIMENSIONS)
    asked = {
        "one motion": lambda d: mbs.simulate(slider_crank(d, like), near, ts=ts, rtol=1e-11, atol=1e-11).states,
        "cycle with pin loads": peak,
        "the same with ten slopes": jax.value_and_grad(peak),
    }
    programs, start = {name: mbs.jit(f, compile=KINDS[how]) for name, f in asked.items()}, time.process_time()
    for f in programs.values():
        jax.block_until_ready(f(d))
    begun = time.process_time() - start
    found = common.cpu_seconds({name: lambda f=f: f(d) for name, f in programs.items()}, 2 if quick else 5)
    rows = _over_motion(f"slider-crank {how}", found, {"the same with ten slopes": "10"})
    return [*rows, common.row(f"slider-crank {how}", "first answers of all three", begun, "s CPU")]


def _over_motion(case, found, goals):
    """Rows of seconds over those of one motion."""
    one = found.pop("one motion")
    rows = [common.row(case, "one motion", one, "s CPU")]
    motion = "one motion"
    return rows + [common.row(case, name, x, "s CPU", motion, one, goals.get(name, "")) for name, x in found.items()]


def harmonics(quick):
    """A rotor of 200 coordinates with a law in a bearing, over 100 speeds."""
    disks = [rotors.Disk(20, 20.0, 0.2, 0.4), rotors.Disk(35, 15.0, 0.15, 0.3)]
    bearings = [rotors.Bearing(k, 2e7, 800.0) for k in (5, 45)]
    rotor = rotors.Rotor(rotors.Shaft(np.linspace(0.0, 1.5, 50), 0.03), disks, bearings)
    omega = np.linspace(50.0, 800.0, 5 if quick else 100)
    loads = {"20 x": 2e-3 * omega**2, "20 y": -2e-3j * omega**2}
    laws = {"snubber": (["5 x", "5 y"], lambda x, v: -1e15 * jnp.sum(x**2) * x)}
    rows = []
    for numbers in ((1, 3, 5), (0, 1, 2, 3, 4, 5, 6, 7)):
        ask = lambda n=numbers: mbs.cycles.harmonic_balance(rotor.at_speed, omega, loads, laws, harmonics=n)
        case = f"rotor of {rotor.num_coordinates} coordinates, {len(numbers)} harmonics"
        seconds = common.cpu_seconds({"": lambda ask=ask: ask().amplitudes}, 2 if quick else 3)[""]
        rows.append(common.row(case, f"{omega.size} speeds", seconds, "s CPU", goal="2"))
        rows.append(common.row(case, "speeds with an answer", int(ask().ok.sum()), f"of {omega.size}"))
    return rows


def batch(quick, how="on tapes"):
    """Cycles of 64 and of 1 000 machines in a batch over their one-period motions, warm, on tapes and compiled."""
    like = slider_crank(jnp.asarray(DIMENSIONS))
    first = first_cycle(like)
    spread = np.random.default_rng(0).normal(size=(1000, 10))
    designs = jnp.asarray(DIMENSIONS * (1.0 + 0.02 * spread))

    def near(d):
        return mbs.State.at(slider_crank(d, like), near=first[0], velocities={"main": first[0].velocities[0]})

    def cycle(d):
        system = slider_crank(d, like)
        return mbs.periodic(system, first.period, near(d), free="period", turns={"main": 1}, throw=False).period

    def motion(d):
        options = {"t1": first.period, "rtol": 1e-11, "atol": 1e-11, "throw": False}
        return mbs.simulate(slider_crank(d, like), near(d), **options).end.coordinates

    rows, counts = [], (4,) if quick else {"on tapes": (64, 1000), "compiled": (1000,)}[how]
    for number in counts:
        ask = lambda f, d=designs[:number]: mbs.batch(f, d, progress=False, compile=KINDS[how])
        found, begun = {}, {}
        for name, function in (("one motion", motion), ("cycles", cycle)):
            for seconds in (begun, found) if number == counts[0] else (found,):  # the programs are there by then
                start = time.process_time()
                answer = ask(function)
                seconds[name] = time.process_time() - start
        print(f"{number} machines {how}: {found}, at first {begun}", flush=True)
        case = f"{number} machines {how}"
        rows += [common.row(case, f"first answers of {name}", x, "s CPU") for name, x in begun.items()]
        rows.append(common.row(case, "cycles lost", int(np.sum(np.asarray(answer.status) != 0))))
        rows += _over_motion(case, found, {"cycles": "5"})
    return rows


CASES = {
    "harmonics": harmonics,
    "crank": crank,
    "batch": batch,
    "compiled crank": lambda quick: crank(quick, "compiled"),
    "compiled batch": lambda quick: batch(quick, "compiled"),
}

if __name__ == "__main__":
    common.run_cases(__doc__, CASES)
