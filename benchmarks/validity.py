"""What it costs to watch where models end: motions of four machines beside the same motions unwatched.

Both programs are compiled in this process and run in turn, pair by pair; ratios are medians of pairs.
"""

import statistics
from unittest import mock

import cables
import common
import contact
import elastic_bodies
import hydraulic_arm
import jax
import numpy as np
import program_size

import jaxmbs as mbs


def crane():
    system = cables.crane("cables")
    return system, mbs.State.at(system), {"ts": np.linspace(0.0, cables.END, 31)}


def journal():
    return *contact.slider_crank_model(), {"ts": contact.TURN, "rtol": 1e-6, "atol": 1e-8, "max_steps": 100_000}


def arm():
    system = hydraulic_arm.arm()
    pressures = {f"cylinder.p{k}": p for k, p in enumerate(hydraulic_arm.START)}
    return system, mbs.State.at(system, pin=0.0, internal=pressures), _to(4.0)


def blade():
    system, _ = elastic_bodies.stiffened_beam()
    return system, mbs.State.at(system), _to(3.0)


def _to(end):
    return {"ts": np.linspace(0.0, end, 41), "rtol": 1e-6, "atol": 1e-6}


CASES = {
    "crane with two cables": crane,
    "slider-crank with clearance": journal,
    "hydraulic arm": arm,
    "stiffened beam spun up": blade,
}


def rows_of(case, system, start, settings, pairs):
    """Equations and CPU seconds of a motion that is watched, beside one that is not."""

    def run(start):
        motion = mbs.simulate(system, start, **settings)
        return motion.states.velocities, motion.result

    programs, equations = {}, {}
    for watched in (True, False):
        jax.clear_caches()
        with mock.patch("jaxmbs.motion._result.has_ends", lambda system, watched=watched: watched):
            equations[watched] = program_size.equations(run, start)
            programs[watched] = common.compiled(run, start)[0]
    ratio, seconds = paired({watched: lambda p=program: p(start) for watched, program in programs.items()}, pairs)
    return [
        common.row(case, "equations", equations[True], "", "unwatched", equations[False], "<=1.03"),
        common.row(case, "motion", seconds[True], "s CPU", "unwatched", seconds[False]),
        common.row(case, "ratio of pairs: median", ratio["median"], "", goal="<=1.03"),
        common.row(case, "ratio of pairs: quartiles", "{:.3f} to {:.3f}".format(*ratio["quartiles"])),
    ]


def paired(functions, pairs, least=0.3):
    """Ratios of CPU seconds of the first of two functions to the second, pair by pair; and median seconds."""
    for function in functions.values():
        jax.block_until_ready(function())
    count = max(1, int(least / common.timed(next(iter(functions.values())), 1)))
    times = {name: [] for name in functions}
    for k in range(pairs):
        for name in functions if k % 2 else reversed(functions):
            times[name].append(common.timed(functions[name], count) / count)
    ratios = [a / b for a, b in zip(*times.values(), strict=True)]
    quartiles = np.quantile(ratios, [0.25, 0.75])
    medians = {name: statistics.median(values) for name, values in times.items()}
    return {"median": statistics.median(ratios), "quartiles": quartiles}, medians


def main():
    options = common.parser(__doc__, *CASES).parse_args()
    pairs = 2 if options.quick else 31
    wanted = {case: make for case, make in CASES.items() if common.wanted(options, case)}
    common.report([row for case, make in wanted.items() for row in rows_of(case, *make(), pairs)], options)


if __name__ == "__main__":
    main()
