"""Elements with states: the hydraulic arm HY1 beside Exudyn, and what twenty states cost a four-bar.

HY1's oil is of two pressures; its error is that of the norm of the case at 0.4 s.  Exudyn sets the valve once per
step, so that its error falls with the step alone.
"""

import importlib.util

import common
import four_bars
import jax
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs
from jaxmbs import forces as F

NORM, END, START = 7.103804185290831, 0.4, (2e6, 2e6)
RTOL, STEPS = 1e-6, (1e-3, 2e-5)  # ours; of Exudyn [s]
LENGTH = np.sqrt(2 * 0.25**2)
STATES = 20


def valve(x, v, t):
    """Twice what is missing to the length wanted."""
    return 2.0 * ((jnp.clip(1.0 - jnp.cos(jnp.pi * t), 0.5, 1.5) - 0.5) * 0.1 + LENGTH - x)


def arm(bulk_modulus=1e11, like=None):
    """HY1."""
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    b.body("arm", mass=120.0, com=(0.5, 0.0, 0.0), inertia=10.0)
    b.joint("pin", mbs.Revolute("z"), "ground", "arm")
    law = F.HydraulicCylinder(
        (0.01, 0.01), (1.0, 1.0), bulk_modulus, valve, 2e-5, supply=2e7, damping=2e5, laminar=1.0
    )
    b.force("cylinder", law, between=(("ground", (0.0, -0.25, 0.0)), ("arm", (0.25, 0.0, 0.0))))
    return b.build(like=like)


def norm(system):
    """Norm of the case at its end."""
    start = mbs.State.at(system, pin=0.0, internal={f"cylinder.p{k}": p for k, p in enumerate(START)})
    motion = mbs.simulate(system, start, t1=END, ts=np.array([0.0, END]), rtol=RTOL, atol=RTOL)
    angle = system.coordinates(motion.states)["pin"][-1]
    centre = jnp.stack([0.5 * jnp.cos(angle) - 0.5, 0.5 * jnp.sin(angle), angle])
    pressures = jnp.stack([motion.internal(f"cylinder.p{k}")[-1] for k in (0, 1)])
    return jnp.linalg.norm(centre) + 1e-6 * jnp.linalg.norm(pressures)


def exudyn_run(step):
    """Norm of the case by Exudyn, as a function without arguments."""
    import exudyn as exu
    from exudyn_models import hydraulic_arm

    def run():
        system, read = hydraulic_arm(START)
        settings = exu.SimulationSettings()
        settings.timeIntegration.numberOfSteps = round(END / step)
        settings.timeIntegration.endTime = END
        settings.solutionSettings.writeSolutionToFile = False
        settings.timeIntegration.verboseMode = 0
        settings.timeIntegration.newton.useModifiedNewton = True
        system.SolveDynamic(settings)
        return read()

    return run


def arm_rows(rounds):
    """Rows of HY1: one run, its error, and its gradient by the bulk modulus."""
    case, system, here = "HY1 t=0.4 s", arm(), jnp.asarray(1e11)
    value, _ = common.compiled(lambda E: norm(arm(E, like=system)), here)
    both, _ = common.compiled(jax.value_and_grad(lambda E: norm(arm(E, like=system))), here)
    runs = {"value": lambda: value(here), "gradient": lambda: both(here)}
    has_peer = importlib.util.find_spec("exudyn") is not None
    peers = {f"Exudyn {step:g} s": exudyn_run(step) for step in (STEPS[:1] if rounds == 1 else STEPS) if has_peer}
    seconds = common.cpu_seconds(runs | peers, rounds, least=0.1)
    error = abs(float(value(here)) / NORM - 1.0)
    rows = [common.row(case, "value and gradient", seconds["gradient"] / seconds["value"], "of value", goal="<=5")]
    if not has_peer:
        return [
            *rows,
            common.row(case, f"error at rtol {RTOL:g}", error),
            common.row(case, "one run", seconds["value"], "s CPU"),
        ]
    for name, run in peers.items():
        rows += [
            common.row(case, f"error at rtol {RTOL:g}", error, "", name, abs(run() / NORM - 1.0)),
            common.row(case, "one run", seconds["value"], "s CPU", name, seconds[name], "<=1"),
        ]
    return rows


def four_bar(states):
    """The nominal four-bar with rubber at a joint, whose memory has so many states."""
    lengths = four_bars.LENGTHS
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    for name in four_bars.BARS:
        b.body(
            name,
            mass=lengths[name],
            com=(lengths[name] / 2, 0, 0),
            inertia=mbs.inertia.rod(lengths[name], lengths[name]),
        )
    ends = {name: (lengths[name], 0.0, 0.0) for name in lengths}
    pin = mbs.Revolute("y")
    b.joint("A", pin, "ground", "crank")
    b.joint("B", pin, "crank", "coupler", parent_frame=ends["crank"])
    b.joint("D", pin, "ground", "rocker", parent_frame=ends["ground"])
    b.joint("C", pin, "coupler", "rocker", parent_frame=ends["coupler"], child_frame=ends["rocker"])
    if states:
        b.force("rubber", F.Prony(0.1, 0.1 * np.ones(states), np.geomspace(0.01, 1.0, states)), joint="D")
    else:
        b.force("rubber", F.SpringDamper(0.1), joint="D")
    return b.build()


def states_rows(rounds):
    """Rows of the four-bar: what twenty states add to a step of a motion, and to its compilation."""
    case, runs, compile_seconds, steps = f"four-bar, {STATES} states", {}, {}, {}
    for name, states in (("without", 0), ("with", STATES)):
        system = four_bar(states)
        start = mbs.State.at(system, A=four_bars.START, guess={"B": 0.8, "D": 1.5})

        def run(start, system=system):
            motion = mbs.simulate(system, start, ts=np.array([0.0, 2.0]))
            return motion.states.coordinates, motion.diagnostics.num_steps

        program, compile_seconds[name] = common.compiled(run, start)
        runs[name] = lambda program=program, start=start: program(start)
        steps[name] = int(program(start)[1])
    seconds = common.cpu_seconds(runs, rounds, least=0.1)
    step = {name: seconds[name] / steps[name] for name in runs}
    more = compile_seconds["with"] - compile_seconds["without"]
    return [
        common.row(case, "one step", step["with"], "s CPU", "without states", step["without"], "<=1.1"),
        common.row(case, "compilation of a motion, more", more, "s CPU", goal="<=1"),
    ]


def main():
    options = common.parser(__doc__).parse_args()
    rounds = 1 if options.quick else 7
    common.report([*arm_rows(rounds), *states_rows(rounds)], options)


if __name__ == "__main__":
    main()
