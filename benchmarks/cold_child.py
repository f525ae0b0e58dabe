"""One cold process of `cold_start.py`: `python cold_child.py CASE [FOLDER]` prints its figures as JSON.

Only what commits before knew is asked of the library; what one of them lacks is left out.  "files without .pyc" are
those that Python compiled in this process, as at the first import after a change: the figures of imports hold that,
too, and the error stream says so.
"""

import time

START, BEGIN = time.process_time(), time.time()

import collections  # noqa: E402
import functools  # noqa: E402
import inspect  # noqa: E402
import json  # noqa: E402
import resource  # noqa: E402
import sys  # noqa: E402
from pathlib import Path  # noqa: E402

import jax  # noqa: E402
import jax.monitoring  # noqa: E402
import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402

found, programs = {}, collections.Counter()


def lap(name):
    """Note the CPU seconds since the last call."""
    global START
    now = time.process_time()
    found[f"{name}: CPU"] = now - START
    START = now


import equinox  # noqa: E402, F401

jax.config.update("jax_enable_x64", True)
lap("import of JAX and equinox")

import jaxmbs as mbs  # noqa: E402

lap("import of jaxmbs")
found["import: CPU"] = sum(found.values())

import first_answers  # noqa: E402

GROUND, CRANK, COUPLER, ROCKER = LENGTHS = 1.0, 0.3, 0.9, 0.7
NUMBERS = np.array([*LENGTHS, 1.0, 1.0, 1.0])
SPEEDS = "velocities" if "velocities" in inspect.signature(mbs.State.at).parameters else "rates"
MACHINES = "readme crane beams elastic wheel random sweep body".split()
COMPILED = "/jax/core/compile/backend_compile_duration"

jax.monitoring.register_event_duration_secs_listener(lambda event, *_, **__: programs.update([event]))


def compiled_anew():
    """Number of the library's files that had no .pyc of today's source when this process began."""
    specs = [module.__spec__ for name, module in sys.modules.items() if name.partition(".")[0] == "jaxmbs"]
    places = [Path(spec.cached) for spec in specs if spec and spec.cached]
    return sum(not place.exists() or place.stat().st_mtime >= BEGIN for place in places)


def pendulum():
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    b.body("bob", mass=2.0, com=(0.0, -0.8, 0.0))
    b.joint("pin", mbs.Revolute("z"), "ground", "bob")
    return b.build()


def four_bar(numbers, like=None):
    """Planar, all revolute: three redundant rows."""
    ground, crank, coupler, rocker, *masses = numbers
    b, x = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0)), np.array([1.0, 0.0, 0.0])
    for name, length, mass in zip(("crank", "coupler", "rocker"), (crank, coupler, rocker), masses, strict=True):
        b.body(name, mass=mass, com=x * length / 2.0, inertia=mbs.inertia.rod(mass, length))
    pin = mbs.Revolute("z")
    b.joint("A", pin, "ground", "crank")
    b.joint("B", pin, "crank", "coupler", parent_frame=x * crank)
    b.joint("D", pin, "ground", "rocker", parent_frame=x * ground)
    b.joint("C", pin, "coupler", "rocker", parent_frame=x * coupler, child_frame=x * rocker)
    return b.build(like=like)


def begin(system):
    return mbs.State.at(system, A=0.7, guess={"B": -0.2, "D": 1.2}, **{SPEEDS: {"A": 3.0}})


def force(system, state):
    """Squared force of the crank's pin along the motion."""
    return jnp.sum(mbs.reactions(system, mbs.simulate(system, state, t1=1.0))["A"].force ** 2)


def answers(system, state, jit):
    """Laps of the questions up to the reactions; their motion."""
    motion = jax.block_until_ready(jit(lambda system, state: mbs.simulate(system, state, t1=1.0))(system, state))
    lap("simulate")
    jax.block_until_ready(jit(mbs.reactions)(system, motion))
    lap("reactions")
    return motion


def value(begin=begin, build=lambda: four_bar(NUMBERS), jit=lambda function: function):
    system = build()
    lap("build")
    state = begin(system)
    lap("State.at")
    motion = answers(system, state, jit)
    laps = {name: seconds for name, seconds in found.items() if name.endswith(": CPU") and name != "import: CPU"}
    found["import to reactions: CPU"] = sum(laps.values())
    found["programs from import to reactions"] = programs[COMPILED]
    return system, state, motion


def gradient(system, jit):
    """Of `force` by lengths and masses, reverse mode, from the build on."""

    def loss(numbers):
        new = four_bar(numbers, like=system)
        return force(new, begin(new))

    function = jit(jax.value_and_grad(loss))
    lap("(model)")
    jax.block_until_ready(function(jnp.asarray(NUMBERS)))
    lap("gradient")
    found["memory of the process"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    runs = []
    for _ in range(10):
        lap("(run)")
        jax.block_until_ready(function(jnp.asarray(NUMBERS)))
        lap("(run)")
        runs.append(found["(run): CPU"])
    found["gradient, run"] = 1e3 * min(runs)


def another_length(system):
    lap("(before)")
    new = four_bar(NUMBERS * 1.01)
    jax.block_until_ready(force(new, begin(new)))
    lap("another length")


def sizes(system, state, motion):
    """Equations and bytes of the main questions and of the whole gradient."""
    from program_size import equations, stablehlo_bytes

    is_number = lambda x: jnp.issubdtype(jnp.result_type(x), jnp.inexact)
    leaves, tree = jax.tree.flatten(system)
    numbers = [x for x in leaves if is_number(x)]

    def of_system(question):
        def function(numbers):
            rest = iter(numbers)
            new = jax.tree.unflatten(tree, [next(rest) if is_number(x) else x for x in leaves])
            return [x for x in jax.tree.leaves(question(new)) if is_number(x)]

        return function

    asked = {
        "forward dynamics": lambda s: mbs.forward_dynamics(s, state),
        "simulate": lambda s: mbs.simulate(s, state, t1=1.0),
        "reactions": lambda s: mbs.reactions(s, motion),
        "linearise": lambda s: mbs.linearise(s, state),
        "stiffness": lambda s: mbs.stiffness(s, state),
        "kic": lambda s: mbs.constraints.kic(s, state),
    }
    for name, question in asked.items():
        found[f"{name}: equations"] = equations(of_system(question), numbers)

    def loss(numbers):
        new = four_bar(numbers, like=system)
        return force(new, begin(new))

    found["whole gradient: equations"] = equations(jax.grad(loss), jnp.asarray(NUMBERS))
    found["whole gradient: bytes"] = stablehlo_bytes(jax.grad(loss), jnp.asarray(NUMBERS))


def peak():
    """Of a pin's force along the motion of the four-bar, then of the forces and moments of all joints."""
    system = four_bar(NUMBERS)
    motion = answers(system, begin(system), lambda function: function)
    before = programs[COMPILED]
    jax.block_until_ready(
        mbs.motion.peak(system, motion, lambda s: jnp.linalg.norm(mbs.reactions(system, s)["A"].force))
    )
    lap("peak")
    found["peak: programs"] = programs[COMPILED] - before
    jax.block_until_ready(mbs.motion.load_peaks(system, motion))
    lap("load_peaks")


def arm():
    """Gradient of the largest effort of a drive by the payload: seven hinges, each with a table of its own."""
    times = np.linspace(0.0, 1.0, 5)

    def build(mass, like=None):
        b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
        for k in range(7):
            b.body(f"link{k}", mass=mass if k == 6 else 1.0, com=(0.5, 0.0, 0.0), inertia=(0.01, 0.1, 0.1))
            place = {"parent_frame": (float(k > 0), 0.0, 0.0)}
            drive = mbs.Spline(times, 0.1 * (k + 1) * times**2)
            b.joint(
                f"pin{k}",
                mbs.Revolute("xyz"[k % 3]),
                f"link{k - 1}" if k else "ground",
                f"link{k}",
                **place,
                drive=drive,
            )
        return b.build(like=like)

    first = build(1.0)

    def largest(mass):
        system = build(mass, first)
        motion = mbs.simulate(system, mbs.State.at(system), ts=np.linspace(0.0, 1.0, 65))
        return jnp.max(jnp.abs(mbs.reactions(system, motion)["pin1"].effort))

    lap("(model)")
    jax.block_until_ready(mbs.jit(jax.grad(largest))(2.0))
    lap("gradient of a peak")


def implicit():
    """6 s of a linear system of 102 rows up to 1 MHz under loads sampled at 12 001 times."""
    import diffrax

    n, times = 102, np.linspace(0.0, 6.0, 12_001)
    rng = np.random.default_rng(0)
    shapes = np.linalg.qr(rng.normal(size=(n, n)))[0]
    stiffness = shapes @ np.diag((2 * np.pi * np.geomspace(5.0, 1e6, n)) ** 2) @ shapes.T
    system = mbs.linear.LinearSystem(mass=np.eye(n), stiffness=stiffness, damping=0.5 * np.eye(n), interface=[0])
    push = np.zeros((len(times), n))
    push[:, 0] = np.sin(15.0 * times**2)
    lap("(model)")
    jax.block_until_ready(mbs.simulate(system, ts=times, forces=push, solver=diffrax.Kvaerno5()).displacement)
    lap("implicit motion")


def cube():
    """Modes of a free cube of 8 x 8 x 8 solids."""
    from substructures import block

    _, stiffness, mass, _ = block(8, 8)
    system = mbs.linear.LinearSystem(mass=mass, stiffness=stiffness)
    lap("(model)")
    jax.block_until_ready(mbs.modes(system, num=12).frequencies)
    lap("modes")


def main(case, folder=None):
    lap("first names")
    if case in ("cached", "store", "stored") and hasattr(mbs, "cache"):
        mbs.cache(Path(folder) / "cache")
    if case == "import":
        return
    if case == "pendulum":
        value(lambda s: mbs.State.at(s, pin=1.0), pendulum)
    elif case in ("peak", "arm", "implicit", "cube"):
        {"peak": peak, "arm": arm, "implicit": implicit, "cube": cube}[case]()
    elif case in first_answers.CASES:
        first_answers.CASES[case](lap)
    elif case in MACHINES:
        import first_machines

        lap("(imports)")
        first_machines.CASES[case](lap)
    elif case.startswith("rows: "):
        import first_rows

        lap("(imports)")
        first_rows.CASES[case](lap)
    elif case.startswith(("motion of ", "singular ")):
        import first_motions

        lap("(imports)")
        first_motions.CASES[case](lap, found)
    elif case == "sizes":
        sizes(*value())
    elif case == "store":
        system, state, _ = value()
        mbs.runtime.export(force, (system, state), Path(folder) / "force.mbs")
        main("stored", folder)
    elif case == "stored":
        stored(folder)
    else:
        jit = jax.jit
        if case != "plain" and hasattr(mbs, "jit"):
            jit = functools.partial(mbs.jit, compile="quick") if case == "quick" else mbs.jit
        system = (value(jit=jit) if case == "quick" else value())[0]
        if case == "four-bar":
            another_length(system)
        gradient(system, jit)


def stored(folder):
    """The stored question: its value, then its gradient by the system."""
    program, system = mbs.runtime.load_program(Path(folder) / "force.mbs"), four_bar(NUMBERS)
    state = begin(system)
    jax.block_until_ready(program(system, state))
    lap("stored, value")
    jax.block_until_ready(jax.jit(jax.grad(program, allow_int=True))(system, state))
    lap("stored, gradient")


if __name__ == "__main__":
    main(*sys.argv[1:])
    if anew := compiled_anew():
        print(f"{anew} files of the library had no .pyc, and were compiled first: run it again", file=sys.stderr)
    found["files without .pyc"] = anew
    print(json.dumps({name: figure for name, figure in found.items() if not name.startswith("(")}))
