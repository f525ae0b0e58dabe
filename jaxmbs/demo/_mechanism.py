"""The slider-crank of the demo as a function of its design variables."""

import jax.numpy as jnp
import numpy as np

from .. import State, SystemBuilder
from ..forces import Force, Ramp
from ..joints import Prismatic, Revolute
from ..model import inertia

CRANK = 0.15  # crank radius [m]: half the stroke, which stays as it is
START, SPEED = 0.4, 50.0  # crank angle at t = 0 [rad], its rate [rad/s]
GAS = (-200.0, 0.0, 0.0)  # force on the slider [N]
GRAVITY = (0.0, -9.81, 0.0)
TURN = 2 * np.pi / SPEED  # [s]
TAIL = 0.08  # distance of the rod's balance mass behind the crank pin [m]

#: The mechanism of the reference: no counterweight, no balance mass.
DESIGN = {"counterweight_mass": 0.0, "counterweight_radius": 0.10, "rod_length": 0.5, "rod_tail_mass": 0.0}
BOUNDS = {  # [kg], [m]
    "counterweight_mass": (0.0, 8.0),
    "counterweight_radius": (0.04, 0.12),
    "rod_length": (0.45, 0.7),  # three crank radii and more
    "rod_tail_mass": (0.0, 1.5),
}


def slider_crank(design, driven=True, like=None):
    """The slider-crank with the numbers of a design; traced designs need `like`, a concrete build.

    Counterweight and balance mass are points, opposite to the crank pin and behind it.  The rod keeps its cross
    section: its mass grows with its length, its own inertia with the cube.
    """
    length, stretch = design["rod_length"], design["rod_length"] / 0.5
    weight_at = (-design["counterweight_radius"], 0.0, 0.0)
    crank = (1.2, (0.5 * CRANK, 0.0, 0.0), 0.004)
    rod = (2.0 * stretch, (0.5 * length, 0.0, 0.0), 0.06 * stretch**3)
    parts = {
        "crank": [_part(*crank), (design["counterweight_mass"], weight_at, inertia.point())],
        "rod": [_part(*rod), (design["rod_tail_mass"], (-TAIL, 0.0, 0.0), inertia.point())],
        "slider": [_part(3.0, (0.0, 0.0, 0.0), 0.01)],
    }
    b = SystemBuilder(gravity=GRAVITY)
    for name, pieces in parts.items():
        b.body(name, **inertia.combine(pieces))
    b.frame("counterweight", on="crank", position=weight_at)
    b.frame("rod_tail", on="rod", position=(-TAIL, 0.0, 0.0))
    pin = Revolute(axis="z")
    b.joint("main", pin, "ground", "crank", drive=Ramp(START, SPEED) if driven else None)
    b.joint("crank_pin", pin, "crank", "rod", parent_frame=(CRANK, 0.0, 0.0))
    b.joint("wrist", pin, "rod", "slider", parent_frame=(length, 0.0, 0.0))
    b.joint("slide", Prismatic(axis="x"), "ground", "slider")
    if driven:
        b.force("gas", Force(GAS), on="slider")
    return b.build(like=like, cut=("wrist",))


def start(system, design, velocities=None):
    """The state at the first crank angle, slider to the right of the crank."""
    rod = -jnp.arcsin(CRANK * np.sin(START) / design["rod_length"])
    slide = CRANK * np.cos(START) + design["rod_length"] * jnp.cos(rod)
    guess = {"main": START, "crank_pin": rod - START, "slide": slide}
    return State.at(system, {"main": START} if velocities else None, velocities=velocities, guess=guess)


def _part(mass, com, moment):
    return mass, com, moment * jnp.eye(3)
