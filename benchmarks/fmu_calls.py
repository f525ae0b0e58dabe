"""A call of an exported FMU beside the program inside of it, called by JAX itself, and a trivial program.

Of a pendulum and a slider-crank: rates at a new state, the derivative along a seed and back, the tick of an instance
that has its answer already, as fmpy's Python calls them; and the first call, which compiles.  Wall time in
microseconds, the least of several rounds; CPU seconds for what happens once.  Prints a table;
`--json FILE` writes it.
"""

import json
import shutil
import tempfile
import time
import zipfile
from ctypes import c_double
from pathlib import Path

import common
import fmpy
import jax
import numpy as np
from fmpy.fmi3 import FMU3Model

import jaxmbs as mbs


def pendulum():
    b = mbs.SystemBuilder()
    b.body("bob", mass=1.0, com=(0.5, 0.0, 0.0), inertia=0.01)
    b.joint("pin", mbs.Revolute("y"), "ground", "bob")
    b.force("motor", mbs.Actuator(0.0), joint="pin")
    system = b.build()
    return system, mbs.State.at(system, pin=0.3), "pin"


def slider_crank():
    b = mbs.SystemBuilder()
    b.body("crank", mass=1.0, com=(0.1, 0.0, 0.0), inertia=0.01)
    b.body("rod", mass=0.5, com=(0.25, 0.0, 0.0), inertia=0.02)
    b.body("piston", mass=0.7, inertia=0.01)
    b.joint("A", mbs.Revolute("y"), "ground", "crank")
    b.joint("B", mbs.Revolute("y"), "crank", "rod", parent_frame=(0.2, 0.0, 0.0))
    b.joint("slide", mbs.Prismatic("x"), "ground", "piston")
    b.joint("C", mbs.Revolute("y"), "rod", "piston", parent_frame=(0.5, 0.0, 0.0))
    b.force("motor", mbs.Actuator(1.0), joint="A")
    system = b.build(guess={"A": 0.5, "B": -0.8}, independent=["A"])
    return system, mbs.State.at(system, A=0.5, velocities={"A": 2.0}, guess={"B": -0.8, "slide": 0.6}), "slide"


CASES = {"pendulum": pendulum, "slider-crank": slider_crank}


def opened(path, folder):
    """An initialised instance of fmpy, and the references of its states and their rates."""
    description = fmpy.read_model_description(str(path))
    fmpy.extract(str(path), unzipdir=folder)
    fmu = FMU3Model(
        guid=description.instantiationToken,
        unzipDirectory=folder,
        modelIdentifier=description.modelExchange.modelIdentifier,
        instanceName="one",
    )
    fmu.instantiate()
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    fmu.enterContinuousTimeMode()
    rates = [unknown.variable for unknown in description.derivatives]
    return fmu, [rate.derivative.valueReference for rate in rates], [rate.valueReference for rate in rates]


def least_wall(call, rounds, count):
    """Microseconds of a call: the least mean of several rounds."""
    found = []
    for _ in range(rounds):
        start = time.perf_counter()
        for _ in range(count):
            call()
        found.append((time.perf_counter() - start) / count)
    return 1e6 * min(found)


def direct_call(path):
    """A call of the stored program by JAX itself, as the FMU compiles it."""
    with zipfile.ZipFile(path) as file:
        about = json.loads(file.read("resources/about.json"))
        name = "instant_kernel" if "instant_kernel" in about["sha256"] else "instant"
        content = file.read(f"resources/{name}.bin")
    options = about["kernel_options"] if name == "instant_kernel" else None
    z = np.array(about["start"])
    program = jax.jit(jax.export.deserialize(bytearray(content)).call)
    program = program.lower(jax.ShapeDtypeStruct(z.shape, z.dtype)).compile(compiler_options=options)

    def call():
        z[1] += 1e-9
        return np.asarray(program(z))

    call()
    return call


def rows_of(name, quick):
    folder = tempfile.mkdtemp()
    try:
        return _rows_in(name, folder, *((2, 20) if quick else (20, 500)))
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _rows_in(name, folder, rounds, count):
    system, state, output = CASES[name]()
    start = time.process_time()
    path = mbs.export_fmu(system, ["motor"], [output], Path(folder) / "one.fmu", state=state)
    exported = time.process_time() - start
    start = time.process_time()
    fmu, states, unknowns = opened(path, folder)
    begun = time.process_time() - start
    n = len(states)
    x, found = (c_double * n)(), (c_double * n)()
    fmu.getContinuousStates(x, n)

    def same():
        fmu.setContinuousStates(x, n)
        fmu.getContinuousStateDerivatives(found, n)

    def rates():
        x[0] += 1e-9
        same()

    seed = [1.0] * n
    trivial, one = jax.jit(lambda z: 2.0 * z), np.ones(4)
    calls = {
        "rates at a new state": rates,
        "rates at the same state": same,
        "directional derivative": lambda: fmu.getDirectionalDerivative(unknowns, states, seed),
        "adjoint derivative": lambda: fmu.getAdjointDerivative(unknowns, states, seed, nSensitivity=n),
    }
    once = {}
    for what, call in calls.items():
        start = time.process_time()
        call()
        once[what] = time.process_time() - start
    direct = least_wall(direct_call(path), rounds, count)
    floor = least_wall(lambda: np.asarray(trivial(one)), rounds, count)
    walls = {what: least_wall(call, rounds, count) for what, call in calls.items()}
    goal = {"rates at a new state": "100 us"}
    rows = [
        common.row(name, w, x, "us", "the program by JAX", direct, goal=goal.get(w, "")) for w, x in walls.items()
    ]
    rows.append(common.row(name, "a program that doubles four numbers", floor, "us", "the program by JAX", direct))
    rows += [
        common.row(name, "export", exported, "CPU s"),
        common.row(name, "first instance, compiled", begun, "CPU s"),
    ]
    rows += [
        common.row(name, f"first {w}", once[w], "CPU s") for w in ("directional derivative", "adjoint derivative")
    ]
    fmu.freeInstance()
    return rows


if __name__ == "__main__":
    common.run_cases(__doc__, {name: lambda quick, name=name: rows_of(name, quick) for name in CASES})
