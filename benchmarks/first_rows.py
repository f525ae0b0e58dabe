"""First calls on cables of constant length and on joints that rub, for `cold_start.py`.

Each function takes `lap(name)`, which notes the CPU seconds since it was called last.  Before programs ran on tapes
the quickest way to a first gradient was `compile="quick"`.
"""

import functools

import jax
import numpy as np

import jaxmbs as mbs
from jaxmbs.forces import Attachment, Sheave

PIN, ROD = mbs.Revolute("y"), mbs.inertia.rod
quick = mbs.jit if hasattr(mbs.runtime, "tape") else functools.partial(mbs.jit, compile="quick")


def rub(b, joint, mu):
    """Friction of a pin of 20 mm."""
    if hasattr(mbs, "friction"):
        b.friction(f"rub {joint}", joint, mbs.friction.SmoothCoulomb(mu, transition_speed=0.05), radius=0.02)
    else:  # before friction had a room
        b.friction(f"rub {joint}", joint, mu, radius=0.02, transition_speed=0.05)


def atwood(lap):
    """Gradient of the rope's tension after half a second of Atwood's machine, by the lighter mass."""

    def build(light, like=None):
        b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
        b.body("wheel", 1.0, inertia=0.01)
        b.joint("pin", PIN, "ground", "wheel")
        for name, mass, x in (("light", light, -0.2), ("heavy", 5.0, 0.2)):
            b.body(name, mass)
            b.joint(name, mbs.Prismatic("z"), "ground", name, parent_frame=(x, 0, 0))
        path = [Attachment("light"), Sheave("wheel", 0.2, side="+", axis="y"), Attachment("heavy")]
        b.cable("rope", path, free_length=4.0, inextensible=True)
        return b.build(like=like)

    first = build(3.0)

    def tension(light):
        system = build(light, first)
        start = mbs.State.at(system, light=-1.0, pin=0.0, guess={"heavy": -2.0})
        motion = mbs.simulate(system, start, ts=np.linspace(0.0, 0.5, 11))
        return mbs.reactions(system, motion).row("rope").multipliers[-1, 0]

    lap("(model)")
    jax.block_until_ready(quick(jax.grad(tension))(3.0))
    lap("gradient")


def four_bar(rubbing, lap):
    """The first motion of a four-bar, some of whose pins rub."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    lengths = {"crank": 0.3, "coupler": 0.9, "rocker": 0.7}
    for name, length in lengths.items():
        b.body(name, mass=length, com=(length / 2, 0, 0), inertia=ROD(length, length))
    b.joint("A", PIN, "ground", "crank")
    b.joint("B", PIN, "crank", "coupler", parent_frame=(0.3, 0, 0))
    b.joint("D", PIN, "ground", "rocker", parent_frame=(1.0, 0, 0))
    b.joint("C", PIN, "coupler", "rocker", parent_frame=(0.9, 0, 0), child_frame=(0.7, 0, 0))
    for name in rubbing:
        rub(b, name, 0.1)
    system = b.build()
    start = mbs.State.at(system, A=0.7, guess={"B": 0.8, "D": 1.5}, velocities={"A": 2.0})
    lap("(model)")
    jax.block_until_ready(mbs.simulate(system, start, ts=np.array([0.0, 1.0])).end.coordinates)
    lap("motion")


def cranks(lap):
    """Gradient of the angle after ten steps of three parallel cranks by the friction of their six pins."""

    def build(mu, like=None):
        b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
        b.body("bar", 2.0, com=(0.5, 0, 0), inertia=ROD(2.0, 1.0))
        for k in range(3):
            b.body(f"crank {k}", 1.0, com=(0.15, 0, 0), inertia=ROD(1.0, 0.3))
            b.joint(f"foot {k}", PIN, "ground", f"crank {k}", parent_frame=(0.5 * k, 0, 0))
            place = {"parent_frame": (0.3, 0, 0), "child_frame": (0.5 * k, 0, 0)}
            b.joint(f"head {k}", PIN, f"crank {k}", "bar", **place)
            for joint in (f"foot {k}", f"head {k}"):
                rub(b, joint, mu)
        return b.build(
            like=like, guess={**{f"foot {k}": 0.7 for k in range(3)}, **{f"head {k}": -0.7 for k in range(3)}}
        )

    first = build(0.1)

    def angle(mu):
        system = build(mu, first)
        start = mbs.State.at(system, {"foot 0": 0.7}, velocities={"foot 0": 2.0})
        return mbs.simulate(system, start, t1=0.1, dt=0.01).end.coordinates[0]

    lap("(model)")
    jax.block_until_ready(quick(jax.grad(angle))(0.1))
    lap("gradient")


CASES = {
    "rows: atwood": atwood,
    "rows: 0": functools.partial(four_bar, ()),
    "rows: 2": functools.partial(four_bar, ("C", "D")),
    "rows: cranks": cranks,
}
