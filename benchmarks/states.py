"""Cost of internal states: twenty of them in a four-bar, and the samples of a controller.

The four-bar has its twenty states in one law (a rubber's), in twenty blocks of the first order, or in one block.  The
sampled motion has a sample each millisecond; beside it is the same motion saved as often, its controller continuous.
"""

import common
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


def four_bar_rows(rounds):
    """Rows of the four-bar: what twenty states add to a step of a motion, and to its compilation."""
    runs, compile_seconds, steps = {}, {}, {}
    for kind in ("none", "law", "block", "blocks"):
        system = four_bar(kind)
        start = mbs.State.at(system, A=four_bars.START, guess={"B": 0.8, "D": 1.5})

        def run(start, system=system):
            motion = mbs.simulate(system, start, ts=np.array([0.0, END]))
            return motion.states.coordinates, motion.diagnostics.num_steps

        program, compile_seconds[kind] = common.compiled(run, start)
        runs[kind] = lambda program=program, start=start: program(start)
        steps[kind] = int(program(start)[1])
    seconds, rows = common.cpu_seconds(runs, rounds, least=0.1), []
    step = {kind: seconds[kind] / steps[kind] for kind in runs}
    for kind in ("law", "block", "blocks"):
        case = f"four-bar, {STATES} states: {kind}"
        more = compile_seconds[kind] - compile_seconds["none"]
        rows += [
            common.row(case, "one step", step[kind], "s CPU", "without states", step["none"], "<=1.1"),
            common.row(case, "compilation of a motion, more", more, "s CPU", goal="<=1"),
        ]
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
        run = lambda start, system=system, ts=ts: mbs.simulate(system, start, ts=ts).states.coordinates  # noqa: E731
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
    options = common.parser(__doc__).parse_args()
    rounds = 1 if options.quick else 7
    common.report([*four_bar_rows(rounds), *sample_rows(rounds)], options)


if __name__ == "__main__":
    main()
