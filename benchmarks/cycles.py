"""Costs of cycles beside those of one period's motion, and of harmonic balance: CPU seconds of this process.

python benchmarks/cycles.py            # all
python benchmarks/cycles.py harmonics  # one of: crank harmonics batch
"""

import sys
import time

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs
from jaxmbs import rotors

jax.config.update("jax_enable_x64", True)


def seconds(function, times=2):
    """Least CPU seconds of calls after the first."""
    jax.block_until_ready(function())
    found = []
    for _ in range(times):
        start = time.process_time()
        jax.block_until_ready(function())
        found.append(time.process_time() - start)
    return min(found)


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


DIMENSIONS = np.array([1.2, 0.075, 0.004, 2.0, 0.25, 0.06, 3.0, 0.15, 0.5, 8.0])


def crank():
    """A slider-crank's cycle with all pin loads, and its gradient by ten dimensions, over one period's motion."""
    like = slider_crank(jnp.asarray(DIMENSIONS))
    start = mbs.State.at(like, velocities={"main": 20.0}, guess={"main": 0.0, "slide": 0.65})
    first = mbs.periodic(like, 2.0 * np.pi / 20.0, start, free="period", turns={"main": 1})
    near, period = first[0], first.period

    def peak(d):
        system = slider_crank(d, like)
        cycle = mbs.periodic(system, period, near, free="period", turns={"main": 1}, throw=False)
        loads = mbs.reactions(system, cycle)
        return sum(jnp.sum(loads[name].force ** 2) for name in loads)

    ts = jnp.linspace(0.0, period, 121)
    motion = mbs.jit(lambda d: mbs.simulate(slider_crank(d, like), near, ts=ts, rtol=1e-11, atol=1e-11).states)
    d = jnp.asarray(DIMENSIONS)
    plain, sloped = mbs.jit(peak), mbs.jit(jax.value_and_grad(peak))
    one, value = (seconds(lambda f=f: f(d)) for f in (motion, plain))
    print(f"slider-crank: motion {one:.4f} s; cycle with loads {value / one:.1f} of it", flush=True)
    gradient = seconds(lambda: sloped(d))
    print(f"with its gradient by ten dimensions {gradient / one:.1f}")


def harmonics():
    """A rotor of 200 coordinates with a law in a bearing, over 100 speeds."""
    disks = [rotors.Disk(20, 20.0, 0.2, 0.4), rotors.Disk(35, 15.0, 0.15, 0.3)]
    bearings = [rotors.Bearing(k, 2e7, 800.0) for k in (5, 45)]
    rotor = rotors.Rotor(rotors.Shaft(np.linspace(0.0, 1.5, 50), 0.03), disks, bearings)
    omega = np.linspace(50.0, 800.0, 100)
    loads = {"20 x": 2e-3 * omega**2, "20 y": -2e-3j * omega**2}
    laws = {"snubber": (["5 x", "5 y"], lambda x, v: -1e15 * jnp.sum(x**2) * x)}
    for numbers in ((1, 3, 5), (0, 1, 2, 3, 4, 5, 6, 7)):
        ask = lambda n=numbers: mbs.cycles.harmonic_balance(rotor.at_speed, omega, loads, laws, harmonics=n)
        found = ask()
        spent = seconds(lambda ask=ask: ask().amplitudes)
        print(
            f"harmonic balance, {rotor.num_coordinates} coordinates, 100 speeds, {len(numbers)} harmonics:", end=" "
        )
        print(f"{spent:.2f} CPU s, found at {int(found.ok.sum())} speeds")


def batch():
    """Cycles of 1000 machines in a batch over their one-period motions."""
    like = slider_crank(jnp.asarray(DIMENSIONS))
    start = mbs.State.at(like, velocities={"main": 20.0}, guess={"main": 0.0, "slide": 0.65})
    first = mbs.periodic(like, 2.0 * np.pi / 20.0, start, free="period", turns={"main": 1})
    designs = jnp.asarray(DIMENSIONS * (1.0 + 0.02 * np.random.default_rng(0).normal(size=(1000, 10))))

    def cycle(d):
        near = mbs.State.at(slider_crank(d, like), near=first[0], velocities={"main": first[0].velocities[0]})
        return mbs.periodic(
            slider_crank(d, like), first.period, near, free="period", turns={"main": 1}, throw=False
        ).period

    def motion(d):
        near = mbs.State.at(slider_crank(d, like), near=first[0], velocities={"main": first[0].velocities[0]})
        options = {"t1": first.period, "rtol": 1e-11, "atol": 1e-11, "throw": False}
        return mbs.simulate(slider_crank(d, like), near, **options).end.coordinates

    one, both = (seconds(lambda f=f: mbs.batch(f, designs, progress=False).values, 1) for f in (motion, cycle))
    print(f"1000 machines: motions {one:.1f} CPU s, cycles {both / one:.1f} times that")


if __name__ == "__main__":
    for name in sys.argv[1:] or ("harmonics", "crank", "batch"):
        globals()[name]()
