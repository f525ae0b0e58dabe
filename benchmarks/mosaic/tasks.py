"""The three tasks for jaxmbs: functions of a dict of controls to a dict of outputs, as Tesseracts have them.

Each has a twin `truth` of one flat vector of the controls in the order of `controls`.
"""

from collections.abc import Callable
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
import truth

import jaxmbs as mbs

END = 0.4  # of the motions [s]
ANGLE, CRANK = 0.3, -1.0  # of the chain's rods and of the crank at the start, about y [rad]
TIGHT = {"rtol": 1e-11, "atol": 1e-11}


@dataclass(frozen=True)
class Task:
    """`function` of `controls` to {"output": (m,)}, and the same of a flat vector in complex numbers."""

    name: str
    function: Callable
    controls: dict
    truth: Callable

    @property
    def flat(self):
        """All controls (n,)."""
        return np.concatenate([np.ravel(x) for x in self.controls.values()])


def rod(b, name, mass, length):
    """A slender rod along x from its joint."""
    # a thin rod has no inertia about itself: one that matters in no plane motion keeps the mass matrix regular
    inertia = mass * length**2 / 12.0
    b.body(name, mass=mass, com=(0.5 * length, 0.0, 0.0), inertia=jnp.full(3, inertia))


def chain(links):
    """Gradient of a chain: place of its tip after a motion, by masses and lengths."""

    def build(design, like=None):
        b = mbs.SystemBuilder(gravity=(0.0, 0.0, -truth.GRAVITY))
        for k in range(links):
            rod(b, f"rod {k}", design["mass"][k], design["length"][k])
            below, place = (f"rod {k - 1}", (design["length"][k - 1], 0.0, 0.0)) if k else ("ground", (0.0, 0.0, 0.0))
            b.joint(f"pin {k}", mbs.Revolute("y"), below, f"rod {k}", parent_frame=place)
        return b.build(like=like)

    controls = {"mass": np.linspace(1.0, 1.5, links), "length": np.linspace(0.3, 0.2, links)}
    like = build(controls)

    def function(design):
        system = build(design, like)
        start = mbs.State.at(system, {"pin 0": ANGLE})
        end = mbs.simulate(system, start, ts=jnp.array([0.0, END]), throw=False, **TIGHT).end
        last = f"rod {links - 1}"
        tip = mbs.position(system, end, last) + mbs.rotation(system, end, last)[:, 0] * design["length"][-1]
        return {"output": tip[jnp.array([0, 2])]}

    return Task(f"chain of {links}", function, controls, lambda x: truth.chain(x[:links], x[links:], END, ANGLE))


def four_bar(bearing):
    """Gradient of a four-bar's motion, or of its crank's bearing load at the end of it, by masses and lengths."""

    def build(design, like=None):
        (m1, m2, m3), (l1, l2, l3, l0) = design["mass"], design["length"]
        b = mbs.SystemBuilder(gravity=(0.0, 0.0, -truth.GRAVITY))
        for name, mass, length in (("crank", m1, l1), ("coupler", m2, l2), ("rocker", m3, l3)):
            rod(b, name, mass, length)
        b.joint("A", mbs.Revolute("y"), "ground", "crank")
        b.joint("B", mbs.Revolute("y"), "crank", "coupler", parent_frame=(l1, 0.0, 0.0))
        b.joint("D", mbs.Revolute("y"), "ground", "rocker", parent_frame=(l0, 0.0, 0.0))
        frames = {"parent_frame": (l2, 0.0, 0.0), "child_frame": (l3, 0.0, 0.0)}
        b.joint("C", mbs.Revolute("y"), "coupler", "rocker", **frames)
        return b.build(like=like)

    controls = {"mass": np.array([1.0, 2.0, 1.5]), "length": np.array([0.2, 0.5, 0.4, 0.55])}
    like = build(controls)

    def function(design):
        system = build(design, like)
        start = mbs.State.at(system, {"A": CRANK}, guess={"B": 0.7, "D": -1.2})
        end = mbs.simulate(system, start, ts=jnp.array([0.0, END]), throw=False, **TIGHT).end
        if bearing:
            return {"output": mbs.reactions(system, end, frame="world")["A"].force[jnp.array([0, 2])]}
        return {"output": system.coordinates(end)["D"][None]}

    def twin(x):
        return truth.four_bar(x[:3], x[3:], END, CRANK)[1 if bearing else 0]

    return Task("bearing load of a four-bar" if bearing else "motion of a four-bar", function, controls, twin)
