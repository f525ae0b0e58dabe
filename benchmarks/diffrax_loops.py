"""Our loop of steps against `diffrax.diffeqsolve` on the same steps: compile and run of eight programs.

`simulate(loop=...)` takes either.  Each is traced and compiled from cold, then both are run in turns; all figures are
CPU seconds.  Prints a table; `--json FILE` writes it.
"""

import common
import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from trick_programs import LENGTHS, begin, four_bar, pendulum

import jaxmbs as mbs
from jaxmbs import elements, fem, flexible

LOOPS = ("jaxmbs", "diffeqsolve")


def cart():
    """A pendulum on a cart that is driven to and fro."""
    b = mbs.SystemBuilder()
    b.body("cart", mass=1.0)
    b.body("bob", mass=2.0, com=(0.0, 0.0, -0.8))
    b.joint("rail", mbs.Prismatic("x"), "ground", "cart", drive=lambda t: 0.2 * jnp.sin(5.0 * t))
    b.joint("pin", mbs.Revolute("y"), "cart", "bob")
    return b.build()


def disk():
    """A coin that rolls on a plane."""
    b = mbs.SystemBuilder()
    b.body("disk", mass=2.0, inertia=2.0 * 0.09 * np.array([0.25, 0.5, 0.25]))
    b.joint("free", mbs.Free(), "ground", "disk")
    b.constraint("contact", mbs.joints.RollingDisk(0.3), between=("ground", "disk"))
    return b.build()


def rolling_start(system):
    """The coin upright, at a roll."""
    where = {"free": np.array([0.0, 0.0, 0.3, 1.0, 0.0, 0.0, 0.0])}
    return mbs.State.at(system, where, velocities={"free": np.array([1.2, 0.0, 0.0, 0.0, 4.0, 1.0])})


def arm():
    """An elastic arm on a hinge, two modes."""
    nodes = {f"n{k}": (0.25 * k, 0.0, 0.0) for k in range(5)}
    nodes = {"hub": nodes.pop("n0"), **nodes}
    nodes["tip"] = nodes.pop("n4")
    names = list(nodes)
    beam = elements.Beam(70e9, 26e9, 1e-4, 8e-10, 8e-10, 1.6e-9, 2700.0)
    structure = fem.Structure(nodes, {"arm": (beam, list(zip(names, names[1:], strict=False)))})
    frame = flexible.floating_frame(fem.assemble(structure), ("hub", "tip"), num_modes=2, damping_ratio=0.01)
    b = mbs.SystemBuilder()
    b.elastic("arm", frame.body, motions={"tip": mbs.Planar("y")})
    b.joint("hinge", mbs.Revolute("y"), "ground", "arm.hub")
    return b.build()


def crawling():
    """A pendulum in a damper so strong that it crawls."""
    b = mbs.SystemBuilder()
    b.body("rod", mass=1.0, com=(0.5, 0, 0), inertia=mbs.inertia.rod(1.0, 1.0))
    b.joint("pin", mbs.Revolute("y"), "ground", "rod")
    b.force("oil", mbs.SpringDamper(damping=2000.0), joint="pin")
    return b.build()


def motion(system, start, t1, **options):
    """A program of the velocities at the start: where the motion ends, or all of it."""

    def program(loop):
        def run(u):
            state = mbs.State(start.t, start.coordinates, u)
            return mbs.simulate(system, state, t1=t1, loop=loop, throw=False, **options).states.coordinates

        return run, (start.velocities,)

    return program


def batch(number, t1):
    """Motions of four-bars of other lengths."""
    system = four_bar()
    lengths = LENGTHS * (1.0 + 0.05 * np.random.default_rng(2).uniform(-1.0, 1.0, (number, 4)))

    def program(loop):
        def last(lengths):
            new = four_bar(lengths, like=system)
            return mbs.simulate(new, begin(new), t1=t1, loop=loop, throw=False).end.coordinates

        return jax.vmap(last), (jnp.asarray(lengths),)

    return program


def gradient(t1):
    """Of the end of a four-bar's motion by its start, in reverse mode."""
    system = four_bar()
    start = begin(system)

    def program(loop):
        def loss(u):
            state = mbs.State(start.t, start.coordinates, u)
            return jnp.sum(mbs.simulate(system, state, t1=t1, loop=loop, throw=False).end.coordinates ** 2)

        return jax.value_and_grad(loss), (start.velocities,)

    return program


def programs(quick):
    """Name -> program of a loop: a function and its arguments."""
    t1 = 0.05 if quick else 2.0
    simple, loop, driven, coin, soft, stiff = pendulum(), four_bar(), cart(), disk(), arm(), crawling()
    return {
        "pendulum": lambda: motion(simple, mbs.State.at(simple, pin=0.4), t1),
        "four-bar": lambda: motion(loop, begin(loop), t1),
        "driven": lambda: motion(driven, mbs.State.at(driven, pin=0.4), t1),
        "rolling": lambda: motion(coin, rolling_start(coin), t1),
        "elastic": lambda: motion(soft, mbs.State.at(soft, hinge=0.0), 0.02 * t1, rtol=1e-6, atol=1e-6),
        "stiff": lambda: motion(
            stiff, mbs.State.at(stiff, pin=0.0), t1, solver=diffrax.Kvaerno5(), rtol=1e-6, atol=1e-6
        ),
        "batch": lambda: batch(2 if quick else 32, 0.25 * t1),
        "gradient": lambda: gradient(t1),
    }


def rows_of(name, program, rounds):
    """Compile and run of one program by both loops, and how far their results differ."""
    compiled = {loop: common.compiled(*_flat(program(loop))) for loop in LOOPS}
    functions = {
        loop: lambda loop=loop: jax.block_until_ready(compiled[loop][0](*program(loop)[1])) for loop in LOOPS
    }
    runs = common.cpu_seconds(functions, rounds=rounds, least=0.05 if rounds < 5 else 0.2)
    ours, theirs = (jax.tree.leaves(functions[loop]()) for loop in LOOPS)
    apart = max(float(np.max(np.abs(np.asarray(a) - np.asarray(b)))) for a, b in zip(ours, theirs, strict=True))
    first, last = (compiled[loop][1] for loop in LOOPS)
    return [
        common.row(name, "compile, CPU", first, "s", "diffeqsolve", last, "1.2 of ours: over 0.83"),
        common.row(
            name,
            "run, CPU",
            1e3 * runs["jaxmbs"],
            "ms",
            "diffeqsolve",
            1e3 * runs["diffeqsolve"],
            "1.2 of ours: over 0.83",
        ),
        common.row(name, "apart", apart),
    ]


def _flat(program):
    function, arguments = program
    return function, *arguments


def main():
    everything = ("pendulum", "four-bar", "driven", "rolling", "elastic", "stiff", "batch", "gradient")
    options = common.parser(__doc__, *everything).parse_args()
    chosen = {name: make for name, make in programs(options.quick).items() if common.wanted(options, name)}
    rounds = 2 if options.quick else 5
    common.report([row for name, make in chosen.items() for row in rows_of(name, make(), rounds)], options)


if __name__ == "__main__":
    main()
