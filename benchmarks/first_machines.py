"""First calls on machines of every kind for `cold_start.py`: README's program, a crane, exact beams, an elastic
four-bar, a wheel on a road, loads of a random test, a small sweep, one body in the plane.

Each function takes `lap(name)`, which notes the CPU seconds since it was called last.
"""

import contextlib
import io
import re
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs
from jaxmbs import elements, fem, flexible
from jaxmbs import qualification as qual
from jaxmbs.contact import HuntCrossley, SphereOnPlane
from jaxmbs.forces import Attachment, Sheave

try:
    from jaxmbs.friction import SmoothCoulomb
except ImportError:  # before friction had a room
    from jaxmbs.contact import DryFriction as SmoothCoulomb

PIN, X = mbs.Revolute("z"), np.array([1.0, 0.0, 0.0])
ROD = mbs.inertia.rod


def readme(lap):
    """README's first program."""
    text = (Path(__file__).parent.parent / "README.md").read_text()
    program = re.search(r"```python\n(import jax\n.*?)```", text, re.S).group(1)
    with contextlib.redirect_stdout(io.StringIO()):
        exec(compile(program, "README.md", "exec"), {"__name__": "readme"})
    lap("README's program")


def hoist(ramp, like=None):
    """A load in the loop of a rope, hoisted by a drum."""
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    b.body("hook", 800.0)
    b.joint("hook", mbs.Prismatic("z"), "ground", "hook", parent_frame=(2.1, 0, -1.0))
    b.body("drum", 50.0)
    drive = mbs.Step(0.1, ramp, 0.0, -0.8)
    b.joint("drum", mbs.Prismatic("z"), "ground", "drum", parent_frame=(2.4, 0, -1.0), drive=drive)
    wheels = Sheave("hook", 0.1, side="-", axis="y"), Sheave(("ground", (2.3, 0, 0)), 0.1, side="+", axis="y")
    path = [Attachment(("ground", (2.0, 0, 0))), *wheels, Attachment("drum")]
    length = 3.0 + 0.2 * np.pi - 800.0 * 9.81 / 2 / 4e5
    b.cable("rope", path, stiffness=4e5, damping=2e3, free_length=length)
    return b.build(like=like)


def crane(lap):
    """The time in which a drive brings a load to its speed, so that the peak of the rope's force is least."""
    first = hoist(0.4)

    def peak(design):
        system = hoist(design["ramp"], like=first)
        motion = mbs.simulate(system, mbs.State.at(system), ts=np.linspace(0.0, 1.5, 61), gradient="forward")
        force = mbs.dynamics.cable_states(system, motion)["rope"].tension
        return jnp.max(force) / 4e3 + 0.3 * design["ramp"]

    mbs.minimise(peak, {"ramp": 0.4}, {"ramp": (0.1, 1.2)}, steps=6, progress=False, gradient="forward")
    lap("minimise of one variable")


def beams(lap):
    """A whip of exact beams: rest, section forces, modes about it, a motion."""
    young, side, length = 70e9, 0.02, 1.0
    inertia = side**4 / 12
    section = mbs.forces.BeamSection.of_material(young, 26e9, 2700.0, side**2, inertia, inertia)
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    b.beam("whip", section, [(0, 0, 0), (length, 0, 0)], elements=4)
    b.joint("clamp", mbs.Weld(), "ground", "whip.0")
    b.force("bend", mbs.Torque((0, 0, 0.3 * young * inertia / length)), on="whip.4")
    system = b.build()
    rest = mbs.equilibrium(system, mbs.State.at(system)).state
    jax.block_until_ready(flexible.section_forces(system, rest, "whip"))
    jax.block_until_ready(mbs.modes(system, rest).frequencies)
    options = {"solver": mbs.ode.Rodas5P(), "dt": 2e-3}
    jax.block_until_ready(mbs.simulate(system, rest, ts=np.linspace(0.0, 0.02, 5), **options).ts)
    lap("rest, sections, modes, motion")


def elastic_four_bar():
    """A four-bar with an elastic coupler, and where it starts."""
    side, n = 0.02, 6
    inertia = side**4 / 12
    beam = elements.Beam(70e9, 26e9, side**2, inertia, inertia, 0.141 * side**4, density=2700.0)
    nodes = {name: (x, 0, 0) for name, x in zip(("near", *"12345", "far"), np.linspace(0.0, 0.9, n + 1), strict=True)}
    names = list(nodes)
    structure = fem.Structure(nodes, {"beam": (beam, list(zip(names, names[1:], strict=False)))})
    frame = flexible.floating_frame(fem.assemble(structure), ("near", "far"), num_modes=2, damping_ratio=0.01)
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    for name, length in (("crank", 0.3), ("rocker", 0.7)):
        b.body(name, mass=1.0, com=X * length / 2.0, inertia=ROD(1.0, length))
    b.elastic("coupler", frame.body, motions={"far": mbs.Planar("z")})
    b.joint("A", PIN, "ground", "crank")
    b.joint("B", PIN, "crank", "coupler.near", parent_frame=X * 0.3)
    b.joint("D", PIN, "ground", "rocker", parent_frame=X)
    b.joint("C", PIN, "coupler.far", "rocker", child_frame=X * 0.7)
    system = b.build()
    return system, mbs.State.at(system, A=0.7, guess={"B": -0.2, "D": 1.2})


def elastic(lap):
    """Motion of a four-bar with an elastic coupler."""
    system, state = elastic_four_bar()
    lap("(model)")
    options = {"solver": mbs.ode.Rodas5P(), "rtol": 1e-5, "atol": 1e-7}
    jax.block_until_ready(mbs.simulate(system, state, ts=np.linspace(0.0, 0.2, 11), **options).ts)
    lap("elastic motion")


def wheel(lap):
    """Gradient of the load of a wheel that rolls over a road under a sprung mass, by its spring and damper."""

    def build(spring, damper, like=None):
        b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
        b.body("carriage", mass=200.0)
        b.joint("along", mbs.Prismatic("x"), "ground", "carriage", parent_frame=(0, 0, 0.55))
        b.body("hub", mass=20.0)
        b.joint("travel", mbs.Prismatic("z"), "carriage", "hub", parent_frame=(0, 0, -0.26))
        b.body("wheel", mass=20.0, inertia=(0.6, 1.0, 0.6))
        b.joint("axle", mbs.Revolute("y"), "hub", "wheel")
        law = mbs.SpringDamper(stiffness=spring, damping=damper, free_length=0.0)
        b.force("suspension", law, joint="travel")
        tyre = HuntCrossley(stiffness=2e5, exponent=1.0, damping=0.1, transition=1e-3)
        b.contact("tyre", SphereOnPlane(0.3), "wheel", "ground", tyre, SmoothCoulomb(0.8, transition_speed=0.1))
        return b.build(like=like)

    first = build(2e4, 1500.0)

    def load(numbers):
        system = build(*numbers, like=first)
        state = mbs.State.at(system, velocities={"along": 5.0, "axle": 15.0})
        motion = mbs.simulate(system, state, ts=np.linspace(0.0, 0.2, 11))
        return jnp.sum(mbs.dynamics.contact_load(system, motion, "tyre").normal_force ** 2)

    lap("(model)")
    jax.block_until_ready(mbs.jit(jax.grad(load))(jnp.array([2e4, 1500.0])))
    lap("gradient of a wheel's load")


def random_loads(lap):
    """432 loads of a structure in a random test."""
    n, rng = 60, np.random.default_rng(0)
    stiffness = 4e6 * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    names = [f"unit{k} z" for k in range(n)]
    places = {f"unit{k}": (0.0, 0.0, float(k)) for k in range(n)}
    matrices = {"mass": 2.0 * np.eye(n), "stiffness": stiffness, "damping": 1e-5 * stiffness}
    system = mbs.LinearSystem(**matrices, coordinates=names, positions=places)
    table = mbs.fatigue.psd_table([20, 50, 800, 2000], [0.026, 0.16, 0.16, 0.026], unit="g^2/Hz")
    loads = rng.normal(size=(432, n)) * 1e5
    lap("(model)")
    out = {"loads": qual.Recovery(lambda x: loads @ x)}
    found = mbs.random_response(system, {"base": qual.BaseAcceleration(table, "z")}, out)
    jax.block_until_ready(found.rms)
    lap("432 random loads")


def sweep(lap):
    """A sweep of 64 four-bars with the loads along their motions."""

    def build(design, like=None):
        b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
        for name, length in (("crank", design["crank"]), ("coupler", 0.9), ("rocker", 0.7)):
            b.body(name, mass=1.0, com=X * length / 2.0, inertia=ROD(1.0, length))
        b.joint("A", PIN, "ground", "crank")
        b.joint("B", PIN, "crank", "coupler", parent_frame=X * design["crank"])
        b.joint("D", PIN, "ground", "rocker", parent_frame=X)
        b.joint("C", PIN, "coupler", "rocker", parent_frame=X * 0.9, child_frame=X * 0.7)
        return b.build(like=like)

    first = build({"crank": 0.3})

    def loads(design):
        system = build(design, like=first)
        state = mbs.State.at(system, A=0.7, velocities={"A": 3.0}, guess={"B": -0.2, "D": 1.2})
        motion = mbs.simulate(system, state, ts=np.linspace(0.0, 0.5, 11))
        return {"force": jnp.max(jnp.linalg.norm(mbs.reactions(system, motion)["A"].force, axis=-1))}

    lap("(model)")
    mbs.sweep(loads, {"crank": np.linspace(0.25, 0.35, 64)}, progress=False)
    lap("sweep of 64 with loads")


def planar_body(lap):
    """Gradient of a motion of one body in the plane under two linear forces."""

    def build(stiffness, like=None):
        b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
        b.body("body", mass=2.0, inertia=(0.1, 0.1, 0.1))
        b.joint("plane", mbs.Planar("z"), "ground", "body")
        for name, place in (("left", (-0.3, 0.0, 0.0)), ("right", (0.3, 0.1, 0.0))):
            spring = mbs.SpringDamper(stiffness=stiffness, damping=1.0, free_length=0.4)
            b.force(name, spring, between=(("ground", (3.0 * place[0], 0.0, 0.0)), ("body", place)))
        return b.build(like=like)

    first = build(50.0)

    def end(stiffness):
        system = build(stiffness, like=first)
        return jnp.sum(mbs.simulate(system, mbs.State.at(system), t1=1.0).end.coordinates ** 2)

    lap("(model)")
    jax.block_until_ready(mbs.jit(jax.grad(end))(jnp.asarray(50.0)))
    lap("gradient of one body's motion")


CASES = {
    "readme": readme,
    "crane": crane,
    "beams": beams,
    "elastic": elastic,
    "wheel": wheel,
    "random": random_loads,
    "sweep": sweep,
    "body": planar_body,
}
