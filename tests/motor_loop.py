"""A motor with the loop of its speed, and its equations as matrices, for the tests of signals in several rooms."""

import numpy as np

import jaxmbs as mbs
from jaxmbs import blocks, forces

NUMBERS = {"R": 1.0, "L": 0.05, "k": 0.1, "J": 0.01, "c": 0.002, "kp": 1.0, "ki": 5.0, "target": 10.0}


def build(numbers=NUMBERS, like=None, limit=None):
    n = {**NUMBERS, **numbers}
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("rotor", mass=1.0, inertia=(n["J"],) * 3)
    b.joint("pin", mbs.Revolute("z"), "ground", "rotor")
    b.force("motor", forces.Motor(0.0, n["R"], n["L"], n["k"]), joint="pin")
    b.force("drag", mbs.SpringDamper(0.0, n["c"]), joint="pin")
    b.measure("speed", joint="pin", of="velocity")
    b.block("loop", blocks.PI(n["kp"], n["ki"], n["target"], limit), reads="speed", drives="motor")
    return b.build(like=like)


def matrices(numbers=NUMBERS):
    """A (3, 3) and b (3,) of `d(speed, current, integral)/dt = A x + b target`."""
    R, L, k, J, c, kp, ki, _ = (float({**NUMBERS, **numbers}[name]) for name in NUMBERS)
    A = [[-c / J, k / J, 0.0], [-(k + kp) / L, -R / L, 1.0 / L], [-ki, 0.0, 0.0]]
    return np.array(A), np.array([0.0, kp / L, ki])
