"""Straight beams as elastic bodies, and mechanisms made of them."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs
from jaxmbs.elements import Beam
from jaxmbs.fem import Structure, assemble
from jaxmbs.flexible import floating_frame
from jaxmbs.kinematics._poses import neutral_coordinates, step_coordinates


def beam_structure(length, elements, **section):
    """Nodes "0" ... along x, of equal elements."""
    numbers = {"young": 7e10, "shear_modulus": 2.6e10, "area": 4e-4, "inertia_y": 1.2e-8, "inertia_z": 1.5e-8}
    element = Beam(**{**numbers, "torsion": 2e-8, "density": 2700.0, "reference": (0.0, 1.0, 0.0), **section})
    x = jnp.linspace(0.0, 1.0, elements + 1) * length
    nodes = jnp.stack([x, jnp.zeros_like(x), jnp.zeros_like(x)], axis=1)
    return Structure(nodes, {"beam": (element, [(i, i + 1) for i in range(elements)])})


@eqx.filter_jit
def elastic_beam(length=1.0, elements=8, num_modes=2, interfaces=None, damping_ratio=None, **section):
    """A free beam between its ends."""
    structure = beam_structure(length, elements, **section)
    interfaces = ("0", str(elements)) if interfaces is None else interfaces
    return floating_frame(assemble(structure), interfaces, num_modes, damping_ratio)


def chain_of_beams(parts, joint, gravity=(0.0, 0.0, 0.0), motion=None, drive=None, **options):
    """A beam cut into equal elastic bodies welded end to end, hung on the ground by a joint: (system, frame)."""
    length = options.pop("length", 1.0)
    frame = elastic_beam(length / parts, **options)
    first, last = frame.body.interfaces
    b = mbs.SystemBuilder(gravity=gravity)
    motions = None if motion is None else {last: motion}
    for k in range(parts):
        b.elastic(f"part{k}", frame.body, motions)
    b.joint("root", joint, "ground", f"part0.{first}", drive=drive)
    for k in range(1, parts):
        b.joint(f"weld{k}", mbs.Weld(), f"part{k - 1}.{last}", f"part{k}.{first}")
    return b.build(), frame


def arch_of_beams(parts, linear_solver, body=None):
    """Beams of 0.5 m in a row with pins between them, from pin to pin on the ground, falling from rest: a loop."""
    body, pin = elastic_beam(0.5, 4, num_modes=1, young=7e8).body if body is None else body, mbs.Revolute("y")
    first, last = body.interfaces
    b = mbs.SystemBuilder()
    for k in range(parts):
        b.elastic(f"part{k}", body, motions={last: mbs.Planar("y")})
    b.joint("pin0", pin, "ground", f"part0.{first}")
    for k in range(1, parts):
        b.joint(f"pin{k}", pin, f"part{k - 1}.{last}", f"part{k}.{first}")
    b.joint("end", pin, "ground", f"part{parts - 1}.{last}", parent_frame=(0.45 * parts, 0.0, 0.0))
    system, turn = b.build(cut=["end"], linear_solver=linear_solver), np.arccos(0.9)
    guess = {f"pin{k}": turn * (1 if k == 0 else 2 * (-1) ** k) for k in range(parts)}
    return system, mbs.State.at(system, guess=guess)


def random_state(system, seed=0, size=0.02, speed=1.0):
    """Small deformations, large rigid motion, all of it moving."""
    random = np.random.default_rng(seed)
    top = system.topology
    rest, move = jnp.asarray(neutral_coordinates(top)), jnp.asarray(size * random.normal(size=top.num_velocities))
    psi = step_coordinates(top, rest, move)
    return mbs.State(jnp.zeros(()), psi, jnp.asarray(speed * random.normal(size=top.num_velocities)))
