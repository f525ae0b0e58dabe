"""Steps that land on 101 saved times against steps that pass over them: what each costs, and how near it stays.

A four-bar for a second; errors against a motion at 1e-13.  Prints a table; `--json FILE` writes it.
"""

import cold_child as model
import common
import diffrax
import numpy as np

import jaxmbs as mbs

SOLVERS = {"Dopri8": diffrax.Dopri8(), "Tsit5": diffrax.Tsit5()}
TOLERANCES = (1e-3, 1e-6, 1e-9, 1e-11)


def rows_of(name, tolerance, system, state, exact):
    """Costs and errors of one solver at one tolerance."""

    def run(over):
        settings = {"rtol": tolerance, "atol": tolerance, "solver": SOLVERS[name], "interpolate": over}
        return mbs.simulate(system, state, t1=1.0, **settings)

    def error(motion, part):
        return np.max(np.abs(np.asarray(getattr(motion.states, part)) - np.asarray(getattr(exact, part))))

    seconds = common.cpu_seconds({over: lambda over=over: run(over) for over in (True, False)})
    motions = {over: run(over) for over in (True, False)}
    figures = {
        "CPU": ("ms", {over: 1e3 * spent for over, spent in seconds.items()}),
        "steps": ("", {over: int(motion.diagnostics.num_steps) for over, motion in motions.items()}),
        "error of coordinates": ("rad", {over: error(motion, "coordinates") for over, motion in motions.items()}),
        "error of velocities": ("rad/s", {over: error(motion, "velocities") for over, motion in motions.items()}),
    }
    case = f"{name} {tolerance:g}, passing over"
    return [common.row(case, what, x[True], unit, "landing", x[False]) for what, (unit, x) in figures.items()]


def main():
    options = common.parser(__doc__).parse_args()
    system = model.four_bar(model.NUMBERS)
    state = model.begin(system)
    exact = mbs.simulate(system, state, t1=1.0, rtol=1e-13, atol=1e-13).states
    solvers, tolerances = (["Dopri8"], [1e-6]) if options.quick else (SOLVERS, TOLERANCES)
    settings = [(name, tolerance) for name in solvers for tolerance in tolerances]
    common.report([row for each in settings for row in rows_of(*each, system, state, exact)], options)


if __name__ == "__main__":
    main()
