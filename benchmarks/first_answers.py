"""First calls of a new user for `cold_start.py`: rest of a loop, tolerances of a lift, a press subject to limits.

Each function takes `lap(name)`, which notes the CPU seconds since it was called last.
"""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs

PIN, TRACK = mbs.Revolute("z"), mbs.Prismatic("x")
ROD = mbs.inertia.rod


def equilibrium(number, lap):
    """Rest of a loop that hangs from the ground at both ends, with a spring at the first."""
    length, b = 2.1 / number, mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    names = [f"link {k}" for k in range(number)]
    for name in names:
        b.body(name, mass=length, com=(length / 2, 0.0, 0.0), inertia=ROD(length, length))
    for k, (first, second) in enumerate(zip(["ground", *names], names, strict=False)):
        b.joint(f"pin {k}", PIN, first, second, parent_frame=(length if k else 0.0, 0.0, 0.0))
    b.joint("end", PIN, "ground", names[-1], parent_frame=(1.2, 0.0, 0.0), child_frame=(length, 0.0, 0.0))
    b.force("spring", mbs.SpringDamper(stiffness=5.0), joint="pin 0")
    system = b.build()
    turn = 2.0 / (number - 1)
    state = mbs.State.at(system, guess={f"pin {k}": turn if k else -1.0 for k in range(number)})
    lap("build")
    found = mbs.equilibrium(system, state)
    jax.block_until_ready(found.state.coordinates)
    lap("equilibrium")


def _point(xy):
    return jnp.stack([jnp.asarray(x, float) for x in (*xy, 0.0)])


PLACES = {"A": (0.0, 0.2), "mid_1": (1.0, 0.0), "mid_2": (1.0, 0.0), "foot": (0.5, 0.05), "eye": (1.25, 0.08)}


def scissor_lift(places, like=None):
    """One pair of arms with rollers on the floor and under the platform, a cylinder from the floor to an arm."""
    p, b = {name: _point(xy) for name, xy in places.items()}, mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    for arm in ("arm 1", "arm 2"):
        b.body(arm, mass=60.0, com=(1.0, 0.0, 0.0), inertia=ROD(60.0, 2.0))
    b.body("floor roller", mass=2.0, inertia=1e-3)
    b.body("platform", mass=300.0, com=(0.9, 0.05, 0.0), inertia=60.0)
    b.body("platform roller", mass=2.0, inertia=1e-3)
    b.body("barrel", mass=30.0, com=(0.4, 0.0, 0.0), inertia=ROD(30.0, 0.8))
    b.body("rod", mass=15.0, com=(-0.4, 0.0, 0.0), inertia=ROD(15.0, 0.8))
    b.joint("A", PIN, "ground", "arm 1", parent_frame=p["A"])
    b.joint("mid", PIN, "arm 1", "arm 2", parent_frame=p["mid_1"], child_frame=p["mid_2"])
    b.joint("C", PIN, "arm 2", "platform", parent_frame=(2.0, 0.0, 0.0))
    b.joint("floor track", TRACK, "ground", "floor roller", parent_frame=p["A"])
    b.joint("B", PIN, "arm 2", "floor roller")
    b.joint("platform track", TRACK, "platform", "platform roller")
    b.joint("D", PIN, "arm 1", "platform roller", parent_frame=(2.0, 0.0, 0.0))
    b.joint("foot", PIN, "ground", "barrel", parent_frame=p["foot"])
    b.joint("cylinder", TRACK, "barrel", "rod", drive=mbs.Step(0.0, 10.0, 0.95, 1.35))
    b.joint("eye", PIN, "rod", "arm 1", child_frame=p["eye"])
    b.force("payload", mbs.Force((0.0, -5000.0, 0.0)), on=("platform", (0.9, 0.1, 0.0)))
    return b.build(like=like)


def lift(lap):
    """Tolerances of the places of a lift's pins, in the largest load of a pin along its way."""
    guess = {"A": 0.5, "mid": np.pi - 1.0, "C": -np.pi + 0.5, "floor track": 1.8, "platform track": 1.8}
    guess |= {"foot": 0.9, "cylinder": 1.0}
    first, times = scissor_lift(PLACES), np.linspace(0.0, 10.0, 41)
    mbs.State.at(first, guess=guess)
    lap("build")

    def largest(places):
        system = scissor_lift(places, like=first)
        loads = mbs.reactions(system, jax.vmap(lambda t: mbs.State.at(system, guess=guess, t=t))(times))
        pins = ("A", "B", "C", "D", "mid", "foot", "eye")
        return jnp.sqrt(jnp.max(jnp.stack([jnp.sum(loads[name].force ** 2, -1) for name in pins])))

    mbs.design.tolerances(largest, PLACES, jax.tree.map(lambda _: 1e-3, PLACES))
    lap("tolerances")


class Motor(eqx.Module):
    """Asynchronous motor behind a gear: torque [N m] by speed [rad/s], by Kloss's formula."""

    pull_out: float = 500.0
    synchronous: float = 6.5
    slip: float = 0.25

    def __call__(self, x, v, t):
        slip = (self.synchronous - v) / self.synchronous
        return 2.0 * self.pull_out * slip * self.slip / (slip**2 + self.slip**2)


LINKS, CLOSED, WORK = {"crank": 0.12, "rod": 0.7, "upper": 0.5, "lower": 0.5}, 0.2, 8e6


def toggle_press(design, like=None):
    """A crank that stretches a knee, which closes a ram on stiff work."""
    r, rod, upper, lower = (design[name] for name in LINKS)
    top, b = CLOSED + upper + lower, mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    b.body("crank", mass=20.0, inertia=3.0)
    b.body("rod", mass=15.0, com=_point((rod / 2, 0.0)), inertia=15.0 * rod**2 / 12)
    b.body("upper", mass=20.0, com=_point((upper / 2, 0.0)), inertia=20.0 * upper**2 / 12)
    b.body("lower", mass=20.0, com=_point((lower / 2, 0.0)), inertia=20.0 * lower**2 / 12)
    b.body("ram", mass=80.0)
    b.joint("shaft", PIN, "ground", "crank", parent_frame=_point((-(rod + r), top - upper)))
    b.joint("crank pin", PIN, "crank", "rod", parent_frame=_point((r, 0.0)))
    b.joint("head", PIN, "ground", "upper", parent_frame=_point((0.0, top)))
    b.joint("knee", PIN, "upper", "lower", parent_frame=_point((upper, 0.0)))
    b.joint("guide", mbs.Prismatic("y"), "ground", "ram")
    b.joint("ram pin", PIN, "lower", "ram", parent_frame=_point((lower, 0.0)))
    b.joint("knee rod", PIN, "rod", "upper", parent_frame=_point((rod, 0.0)), child_frame=_point((upper, 0.0)))
    b.force("motor", mbs.Actuator(Motor()), joint="shaft")
    b.force("work", mbs.BumpStop(WORK, lower=CLOSED + 5e-3, exponent=1.0), joint="guide")
    return b.build(like=like)


def press(lap):
    """Fifteen steps of a search for links that ask less torque for the same stroke and force, by forward mode."""
    first, guess = toggle_press(LINKS), {"crank pin": -np.pi + 0.1, "head": -2.1, "knee": 1.0, "guide": 0.3}

    def answers(design):
        system = toggle_press(design, like=first)
        start = mbs.State.at(system, shaft=np.pi, velocities={"shaft": 6.45}, guess=guess)
        motion = mbs.simulate(system, start, ts=np.linspace(0.0, 1.6, 101), rtol=1e-6, atol=1e-6, gradient="forward")
        height = system.coordinates(motion.states)["guide"]
        torque = Motor()(0.0, system.velocities(motion.states)["shaft"], 0.0)
        force = WORK * jnp.max(jnp.maximum(CLOSED + 5e-3 - height, 0.0))
        return {"torque": jnp.max(torque), "stroke": jnp.max(height) - jnp.min(height), "force": force}

    def objective(design):
        return sum((design[name] / LINKS[name] - 1.0) ** 2 for name in LINKS), answers(design)

    now = {name: float(x) for name, x in answers(LINKS).items()}
    limits = [
        mbs.Limit("torque", "torque", upper=0.8 * now["torque"]),
        mbs.Limit("stroke", "stroke", lower=0.999 * now["stroke"], upper=1.001 * now["stroke"]),
        mbs.Limit("closing force", "force", lower=0.999 * now["force"]),
    ]
    bounds = {name: (0.6 * x, 1.6 * x) for name, x in LINKS.items()}
    lap("build and first motion")
    options = {"steps": 15, "progress": False, "gradient": "forward", "compile": "quick"}
    mbs.minimise(objective, LINKS, bounds, limits=limits, **options)
    lap("minimise")


CASES = {
    "equilibrium 3": functools.partial(equilibrium, 3),
    "equilibrium 5": functools.partial(equilibrium, 5),
    "lift": lift,
    "press": press,
}
