"""Cost of internal states: twenty of them in a four-bar, and the samples of a controller.

The four-bar has its twenty states in one law (a rubber's), in twenty blocks of the first order, or in one block.
Each compilation is in a process of its own, and the least of several counts, as two of the same program differ by
more than the states cost.  The sampled motion has a sample each millisecond; beside it is the same motion saved as
often, its controller continuous.
"""

import subprocess
import sys

import common
import diffrax
import four_bars
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs
from jaxmbs import blocks
from jaxmbs import forces as F

STATES, END = 20, 2.0
CONSTANTS = np.geomspace(0.01, 1.0, STATES)


def four_bar(kind):
    """The nominal four-bar with a spring at a joint, and beside it twenty states: in "none", "law", "blocks" or
    "block"."""
    lengths, pin = four_bars.LENGTHS, mbs.Revolute("y")
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    for name in four_bars.BARS:
        inertia = mbs.inertia.rod(lengths[name], lengths[name])
        b.body(name, mass=lengths[name], com=(lengths[name] / 2, 0, 0), inertia=inertia)
    ends = {name: (lengths[name], 0.0, 0.0) for name in lengths}
    b.joint("A", pin, "ground", "crank")
    b.joint("B", pin, "crank", "coupler", parent_frame=ends["crank"])
    b.joint("D", pin, "ground", "rocker", parent_frame=ends["ground"])
    b.joint("C", pin, "coupler", "rocker", parent_frame=ends["coupler"], child_frame=ends["rocker"])
    law = F.Prony(0.1, 0.1 * np.ones(STATES), CONSTANTS) if kind == "law" else F.SpringDamper(0.1)
    b.force("rubber", law, joint="D")
    if kind in ("blocks", "block"):
        b.measure("angle", joint="D")
        b.force("motor", F.Actuator(0.0), joint="A")
    if kind == "blocks":
        for k, constant in enumerate(CONSTANTS):
            b.block(f"filter {k}", blocks.FirstOrder(constant), reads="angle")
        sums = blocks.Function(lambda u, t: -1e-3 * jnp.sum(u))
        b.block("sum", sums, reads=[f"filter {k}" for k in range(STATES)], drives="motor")
    elif kind == "block":
        A, B = -np.diag(1.0 / CONSTANTS), 1.0 / CONSTANTS[:, None]
        b.block(
            "filters",
            blocks.StateSpace(A, B, -1e-3 * np.ones((1, STATES)), np.zeros((1, 1))),
            reads="angle",
            drives="motor",
        )
    return b.build()


KINDS = ("none", "law", "block", "blocks")
METHODS = {"explicit": {}, "implicit": {"solver": diffrax.Kvaerno5(), "rtol": 1e-6, "atol": 1e-8}}


def program(kind, method):
    """(compiled motion, its start, CPU seconds of the compilation)."""
    system = four_bar(kind)
    start = mbs.State.at(system, A=four_bars.START, guess={"B": 0.8, "D": 1.5})

    def run(start):
        motion = mbs.simulate(system, start, ts=np.array([0.0, END]), **METHODS[method])
        return motion.states.coordinates, motion.diagnostics.num_steps

    executable, seconds = common.compiled(run, start)
    return executable, start, seconds


def compile_seconds(rounds):
    """Least CPU seconds of the compilation of each kind, each in processes of its own."""
    found = dict.fromkeys(KINDS, np.inf)
    for _ in range(rounds):
        for kind in KINDS:
            command = [sys.executable, __file__, "--compile", kind]
            done = subprocess.run(command, capture_output=True, text=True, check=True)
            found[kind] = min(found[kind], float(done.stdout))
    return found


def four_bar_rows(rounds):
    """Rows of the four-bar: what twenty states add to a step of a motion, and to its compilation."""
    rows = []
    for method in METHODS:
        programs = {kind: program(kind, method)[:2] for kind in KINDS}
        steps = {kind: int(run(start)[1]) for kind, (run, start) in programs.items()}
        runs = {kind: lambda run=run, start=start: run(start) for kind, (run, start) in programs.items()}
        seconds = common.cpu_seconds(runs, rounds, least=0.1)
        step = {kind: seconds[kind] / steps[kind] for kind in KINDS}
        for kind in KINDS[1:]:
            case = f"four-bar, {STATES} states: {kind}"
            goal = "<=1.1" if method == "explicit" else ""
            rows.append(
                common.row(case, f"one {method} step", step[kind], "s CPU", "without states", step["none"], goal)
            )
    least = compile_seconds(max(1, rounds // 2))
    for kind in KINDS[1:]:
        more = least[kind] - least["none"]
        case = f"four-bar, {STATES} states: {kind}"
        rows.append(common.row(case, "compilation of a motion, more", more, "s CPU", goal="<=1"))
    return rows


def arm(every):
    """An arm whose motor follows a PI controller, sampled or continuous (None)."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    b.body("arm", mass=1.0, com=(0.3, 0.0, 0.0), inertia=0.05)
    b.joint("pin", mbs.Revolute("y"), "ground", "arm")
    b.force("bearing", mbs.SpringDamper(damping=0.5), joint="pin")
    b.force("motor", F.Actuator(0.0), joint="pin")
    b.measure("angle", joint="pin")
    b.block("controller", blocks.PI(20.0, 10.0, target=0.5), reads="angle", drives="motor", every=every)
    return b.build()


def sample_rows(rounds):
    """Rows of 1 000 samples beside 1 001 saved times."""
    runs = {}
    for name, every, count in (("samples", 1e-3, 2), ("saved times", None, 1001)):
        system = arm(every)
        start, ts = mbs.State.at(system), np.linspace(0.0, 1.0, count)
        run = lambda start, system=system, ts=ts: mbs.simulate(system, start, ts=ts).states.coordinates
        program, _ = common.compiled(run, start)
        runs[name] = lambda program=program, start=start: program(start)
    seconds = common.cpu_seconds(runs, rounds, least=0.1)
    return [
        common.row(
            "arm, PI each ms over 1 s", "1 000 samples", seconds["samples"], "s CPU", "1 001 saved times",
            seconds["saved times"], "<=2",
        )
    ]  # fmt: skip


def main():
    parser = common.parser(__doc__)
    parser.add_argument(
        "--compile", metavar="KIND", choices=KINDS, help="print the seconds of one compilation, alone"
    )
    options = parser.parse_args()
    if options.compile:
        return print(program(options.compile, "explicit")[2])
    rounds = 1 if options.quick else 7
    common.report([*four_bar_rows(rounds), *sample_rows(rounds)], options)


if __name__ == "__main__":
    main()
