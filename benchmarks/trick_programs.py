"""Programs of `compiler_tricks.py`: each a function of arrays, its arguments, and the kind it is compiled as."""

import jax
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs
from jaxmbs import fem, reductions
from jaxmbs.elements import Beam
from jaxmbs.vibration import natural_modes

LENGTHS = np.array([1.0, 0.3, 0.9, 0.7])  # ground, crank, coupler, rocker
AXIS = np.array([1.0, 0.0, 0.0])


def pendulum():
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    b.body("bob", mass=2.0, com=(0.0, -0.8, 0.0))
    b.joint("pin", mbs.Revolute("z"), "ground", "bob")
    return b.build()


def four_bar(lengths=LENGTHS, like=None):
    """Planar, all revolute: three redundant rows."""
    ground, crank, coupler, rocker = lengths
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    for name, length in (("crank", crank), ("coupler", coupler), ("rocker", rocker)):
        b.body(name, mass=1.0, com=AXIS * length / 2.0, inertia=mbs.inertia.rod(1.0, length))
    pin = mbs.Revolute("z")
    b.joint("A", pin, "ground", "crank")
    b.joint("B", pin, "crank", "coupler", parent_frame=AXIS * crank)
    b.joint("D", pin, "ground", "rocker", parent_frame=AXIS * ground)
    b.joint("C", pin, "coupler", "rocker", parent_frame=AXIS * coupler, child_frame=AXIS * rocker)
    return b.build(like=like)


def begin(system, speed=3.0):
    return mbs.State.at(system, A=0.7, guess={"B": -0.2, "D": 1.2}, velocities={"A": speed})


def tree(bodies):
    """A random tree of bodies on revolute joints."""
    rng = np.random.default_rng(3)
    b = mbs.SystemBuilder()
    for k in range(bodies):
        b.body(f"body{k}", mass=1.0 + rng.random(), com=0.1 * rng.normal(size=3), inertia=0.01 + 0.01 * rng.random(3))
        above = "ground" if k == 0 else f"body{rng.integers(k)}"
        b.joint(f"pin{k}", mbs.Revolute(rng.normal(size=3)), above, f"body{k}", parent_frame=0.2 * rng.normal(size=3))
    return b.build()


# -------------------------------------------------------------------------------------------------------- programs
def pendulum_motion(quick):
    system = pendulum()
    start, ts = mbs.State.at(system, pin=0.4), np.linspace(0.0, 1.0 if quick else 10.0, 101)
    return lambda q: mbs.simulate(system, _at(start, q), ts=ts).states.coordinates, (start.coordinates,), "full"


def four_bar_motion(quick):
    system = four_bar()
    start, ts = begin(system), np.linspace(0.0, 0.2 if quick else 2.0, 101)
    return lambda u: mbs.simulate(system, _at(start, u=u), ts=ts).states.coordinates, (start.velocities,), "full"


def four_bar_gradient(quick, kind="full"):
    """Of the end of a motion by its start, in reverse mode."""
    system = four_bar()

    start = begin(system)

    def loss(u):
        return jnp.sum(mbs.simulate(system, _at(start, u=u), t1=0.1 if quick else 2.0).end.coordinates ** 2)

    return jax.value_and_grad(loss), (start.velocities,), kind


def four_bar_gradient_quick(quick):
    return four_bar_gradient(quick, "quick")


def tree_batch(quick):
    """Forward dynamics of 256 states of a tree of 30 bodies."""
    system, number = tree(4 if quick else 30), 4 if quick else 256
    rng, rest = np.random.default_rng(1), mbs.State.at(system)
    q, u = (jnp.asarray(rng.normal(size=(number, len(x)))) for x in (rest.coordinates, rest.velocities))
    one = lambda q, u: mbs.forward_dynamics(system, _at(rest, q, u))[0]
    return jax.vmap(one), (q, u), "full"


def reactions_batch(quick):
    """Loads of 128 four-bars of other lengths."""
    system = four_bar()

    def load(lengths):
        new = four_bar(lengths, like=system)
        return mbs.reactions(new, begin(new))["A"].force

    return load, _designs(2 if quick else 128), "batch"


def motions_batch(quick):
    """Motions of 32 four-bars of other lengths."""
    system = four_bar()

    def last(lengths):
        new = four_bar(lengths, like=system)
        return mbs.simulate(new, begin(new), t1=0.05 if quick else 0.5).end.coordinates

    return last, _designs(2 if quick else 32), "batch"


def structure(thickness, cells):
    """The linear system of a portal of beams with feet held and its middle node as interface."""
    side, rise = np.linspace(0.0, 1.0, cells + 1), np.linspace(0.0, 2.0, cells + 1)
    left = [(0.0, 0.0, z) for z in rise]
    top = [(x, 0.0, 2.0) for x in side[1:]]
    right = [(1.0, 0.0, z) for z in rise[-2::-1]]
    nodes = np.array(left + top + right)
    pairs = np.stack([np.arange(len(nodes) - 1), np.arange(1, len(nodes))], axis=1)
    area, second = thickness**2, thickness**4 / 12.0
    beam = Beam(70e9, 26e9, area, second, second, 2.0 * second, 2700.0)
    last = len(nodes) - 1
    portal = fem.Structure(nodes, {"portal": (beam, pairs)}, {0: "all", last: "all"})
    return fem.assemble(portal, interface=[last // 2])


def structure_modes(quick):
    """Frequencies of a structure of 216 coordinates."""
    cells = 2 if quick else 12

    def frequencies(thickness):
        system = structure(thickness, cells)
        return natural_modes(K=system.stiffness, M=system.mass, num=4).omega

    return frequencies, (jnp.asarray(0.02),), "full"


def craig_bampton_gradient(quick):
    """A frequency of a reduced component, with its derivative by a thickness."""
    cells = 2 if quick else 10

    def lowest(thickness):
        system = structure(thickness, cells)
        reduced = reductions.reduce(system, reductions.CraigBampton(3))
        return natural_modes(K=reduced.stiffness, M=reduced.mass, num=1).omega[0]

    return jax.value_and_grad(lowest), (jnp.asarray(0.02),), "full"


PROGRAMS = {
    "pendulum, motion": pendulum_motion,
    "four-bar, motion": four_bar_motion,
    "four-bar, gradient": four_bar_gradient,
    "four-bar, gradient quick": four_bar_gradient_quick,
    "tree of 30, 256 states": tree_batch,
    "four-bars, loads of 128": reactions_batch,
    "four-bars, 32 motions": motions_batch,
    "structure, modes": structure_modes,
    "Craig-Bampton, gradient": craig_bampton_gradient,
}


def _at(state, q=None, u=None):
    """The state with other coordinates and velocities."""
    return mbs.State(state.t, state.coordinates if q is None else q, state.velocities if u is None else u)


def _designs(number):
    return (jnp.asarray(LENGTHS * (1.0 + 0.05 * np.random.default_rng(2).uniform(-1.0, 1.0, (number, 4)))),)
