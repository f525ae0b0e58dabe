"""Later runs on tapes beside those that XLA compiled in full: motions with their gradients, in the same process.

Flags are those of a user, none. Goal: a tape takes at most twice as long.  Prints a table; `--json FILE` writes it.
"""

import os

os.environ["JAXMBS_BENCHMARK_ENVIRONMENT"] = "user"

import common  # noqa: I001
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import first_motions
import jaxmbs as mbs

MACHINES = {
    f.__name__: f
    for f in (first_motions.four_bar, first_motions.press, first_motions.hydraulic, first_motions.cables)
}
GOAL = "<= 2"


def questions_of(machine, gradient):
    """A motion at eleven times, and the slope of where it ends by the masses."""
    system, start, end = machine()
    ts = np.linspace(0.0, end, 11)

    def motion(mass):
        changed = eqx.tree_at(lambda s: s.mass, system, mass)
        return mbs.simulate(changed, start, ts=ts, gradient=gradient).states.coordinates

    return {"motion": motion, "gradient": jax.grad(lambda mass: jnp.sum(motion(mass)[-1]))}, system.mass


def rows_of(name, quick):
    questions, mass = questions_of(MACHINES[name], "reverse")
    found, scale = [], 0.0
    for question, function in questions.items():
        programs = {kind: mbs.jit(function, compile=kind) for kind in ("tape", "full")}
        answers = {kind: np.asarray(program(mass)) for kind, program in programs.items()}
        scale = scale or np.max(np.abs(answers["full"]))  # of the motion: some gradients are nearly zero
        calls = {kind: lambda program=program: program(mass) for kind, program in programs.items()}
        seconds = common.cpu_seconds(calls, *((1, 0.0) if quick else (5, 0.2)))
        spent = (1e3 * seconds[kind] for kind in ("tape", "full"))
        found.append(common.row(name, f"{question}, tape", next(spent), "ms", "XLA", next(spent), GOAL))
        difference = np.max(np.abs(answers["tape"] - answers["full"])) / scale
        found.append(common.row(name, f"{question}, difference of the scale", difference))
    return found


if __name__ == "__main__":
    common.run_cases(__doc__, {name: lambda quick, name=name: rows_of(name, quick) for name in MACHINES})
