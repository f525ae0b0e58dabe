"""Error against CPU time of every solver at each decade of tolerance, beside Exudyn and MuJoCo.

Mechanisms: a four-bar of one second, A02, A03, C1, a chain of ten, Chaplygin's sleigh, a mass on a stiff strut and
A05, each saved at its end only and compared there.  Exudyn runs its generalised alpha method and MuJoCo its RK4 at
fixed steps.  A run is a call of `simulate` as a user makes it; programs take turns, CPU seconds of all threads,
compilation apart.  The second table has the cheapest run of each solver for each decade of the error.  With `--first
ERROR` the first call of each in a process of its own stands below: the choice where none is named beside the others.
"""

import importlib.util
import os
import subprocess
import sys
import time
from dataclasses import dataclass

import common
import diffrax
import jax
import numpy as np
from solver_cases import CASES

import jaxmbs as mbs

DECADES = tuple(10.0**-k for k in range(3, 11))
SMOOTH, STIFF = ("Tsit5", "Rodas5P"), ("Tsit5", "Rodas5P", "Kvaerno5")
LONGEST = 0.3  # CPU seconds of a run after which a solver is not asked for smaller errors
QUICK = ("sleigh",)
#: First calls are those of a user: on tapes.
AS_USERS = {"JAXMBS_BENCHMARK_ENVIRONMENT": "user", "JAXMBS_COMPILE": "auto", "JAXMBS_STORE": "off"}


@dataclass(frozen=True)
class Run:
    """One run: case, solver and its setting, error of the compared numbers, CPU seconds, steps and those rejected."""

    case: str
    solver: str
    setting: float
    error: float
    seconds: float
    steps: int
    rejected: int = 0


def our_solver(name):
    """A solver by its name; None for the default."""
    return None if name == "default" else getattr(mbs.motion if hasattr(mbs.motion, name) else diffrax, name)()


def our_calls(case, solvers, tolerances, reference=None):
    """{(solver, tolerance): call of `simulate`}."""
    system = case.build()
    start = case.start(system)

    def call(solver, tolerance):
        options = {"solver": our_solver(solver), "rtol": tolerance, "atol": tolerance}
        return lambda: mbs.simulate(system, start, ts=[case.end], throw=False, **options)

    pairs = [(s, t) for s in solvers for t in tolerances]
    read = lambda motion: np.asarray(case.read(system, jax.tree.map(lambda x: x[-1], motion.states)))
    reference = case.reference if reference is None else reference
    if reference is None:
        reference = read(mbs.simulate(system, start, ts=[case.end], rtol=1e-12, atol=1e-12))
    return {pair: call(*pair) for pair in pairs}, read, np.asarray(reference)


def peer_calls(case, quick):
    """{(peer, step): function to the compared numbers} of the peers that are installed."""
    calls = {}
    if case.exudyn is not None and importlib.util.find_spec("exudyn") is not None:
        import exudyn_models

        system, read = case.exudyn(exudyn_models)

        def run(step):
            exudyn_models.solve(system, case.end, step, case.exudyn_radius)
            return read()

        calls |= {("Exudyn", step): lambda step=step: run(step) for step in case.exudyn_steps}
    if case.mujoco is not None and importlib.util.find_spec("mujoco") is not None:
        calls |= {("MuJoCo", step): case.mujoco(step) for step in case.mujoco_steps}
    return dict(list(calls.items())[:1]) if quick else calls


def runs_of(case, solvers, tolerances, rounds, quick=False):
    """All runs of a case that succeed."""
    ours, read, reference = our_calls(case, solvers, tolerances)
    peers = peer_calls(case, quick)
    motions = _motions(case, ours)
    ours = {key: ours[key] for key in motions}
    warm_up = {"warm-up": next(iter(ours.values()))}  # after a peer's run the first of ours meets cold caches
    seconds = common.cpu_seconds(warm_up | ours | peers, rounds, least=0.02)
    for key in ours:
        error, accounts = np.max(np.abs(read(motions[key]) - reference)), motions[key].diagnostics
        yield Run(case.name, *key, error, seconds[key], int(accounts.num_steps), int(accounts.num_rejected))
    for key, call in peers.items():
        yield Run(case.name, *key, np.max(np.abs(call() - reference)), seconds[key], round(case.end / key[1]))


def _motions(case, calls):
    """The motions of the calls that succeed, up to the first long one of each solver."""
    found, ended = {}, set()
    for (solver, tolerance), call in calls.items():
        if solver in ended:
            continue
        motion = call()  # compiles the first time
        if not bool(motion.ok):
            print(f"{case.name} {solver} {tolerance:g}: {motion.status}", flush=True)
            continue
        found[solver, tolerance] = motion
        if common.timed(call, 1) > LONGEST:
            ended.add(solver)
    return found


def table(runs):
    """Every run as text."""
    line = "{:12} {:9} {:>8} {:>9} {:>9} {:>7} {:>8}".format
    lines = [line("case", "solver", "setting", "error", "CPU ms", "steps", "rejected")]
    for r in runs:
        numbers = f"{r.setting:.0e}", f"{r.error:.1e}", f"{1e3 * r.seconds:.3g}"
        lines.append(line(r.case, r.solver, *numbers, r.steps, r.rejected))
    return "\n".join(lines)


def cheapest(runs, solver, error):
    """The cheapest run of a solver with at most this error; None if there is none."""
    good = [run for run in runs if run.solver == solver and run.error <= error]
    return min(good, key=lambda run: run.seconds, default=None)


def decades(runs, solvers):
    """CPU milliseconds of each solver's cheapest run for each decade of the error, as text."""
    lines = ["{:>8}".format("error") + "".join(f"{name:>10}" for name in solvers)]
    for error in DECADES:
        found = [cheapest(runs, name, error) for name in solvers]
        lines.append(f"{error:8.0e}" + "".join(f"{1e3 * r.seconds:10.3g}" if r else f"{'-':>10}" for r in found))
    return "\n".join(lines)


def first_call(name, solver, tolerance):
    """CPU seconds of the first call of `simulate` in this process."""
    case = next(case for case in CASES if case.name == name)
    calls, _, _ = our_calls(case, [solver], [float(tolerance)], np.zeros(1))
    began = time.process_time()
    jax.block_until_ready(next(iter(calls.values()))().states)
    return time.process_time() - began


def first_rows(case, runs, solvers, error):
    """First calls at the settings that reach an error: the default's over the least of the others."""
    found = {}
    for solver in solvers:
        if run := cheapest(runs, solver, error):
            call = [sys.executable, __file__, "--child", case.name, solver, str(run.setting)]
            done = subprocess.run(call, check=True, capture_output=True, text=True, env=os.environ | AS_USERS)
            found[solver] = float(done.stdout.split()[-1])
    print(f"{case.name}, first call at an error of {error:.0e}: {found}", flush=True)
    named = {solver: seconds for solver, seconds in found.items() if solver != "default"}
    if not named or "default" not in found:
        return []
    best = min(named, key=named.get)
    return [
        common.row(case.name, f"first call, error {error:.0e}", found["default"], "s CPU", best, named[best], "< 1.3")
    ]


def rows_of(runs):
    """Rows of a case: each run of ours, and the default's for each decade of the error beside each peer's."""
    rows = []
    for run in runs:
        if run.solver not in ("Exudyn", "MuJoCo"):
            where = f"{run.solver} {run.setting:.0e}"
            rows.append(common.row(run.case, f"error, {where}", run.error, "m or rad"))
            rows.append(common.row(run.case, f"one run, {where}", 1e3 * run.seconds, "ms CPU"))
            rows.append(common.row(run.case, f"steps, {where}", run.steps))
    for peer in ("Exudyn", "MuJoCo"):
        for error in DECADES:
            ours, theirs = cheapest(runs, "default", error), cheapest(runs, peer, error)
            if ours and theirs:
                metric, label = f"error {error:.0e}, default {ours.setting:.0e}", f"{peer}, step {theirs.setting:g}"
                milliseconds = 1e3 * ours.seconds, "ms CPU", label, 1e3 * theirs.seconds
                rows.append(common.row(ours.case, metric, *milliseconds, "< 1"))
    return rows


def main():
    parser = common.parser(__doc__, *(case.name for case in CASES))
    parser.add_argument("--solvers", nargs="+", metavar="SOLVER", help="of diffrax or mbs.motion, and `default`")
    parser.add_argument("--first", type=float, nargs="+", default=(), metavar="ERROR", help="beside first calls too")
    parser.add_argument("--child", nargs=3, help="one first call: case, solver, tolerance")
    options, rows = parser.parse_args(), []
    if options.child:
        print(first_call(*options.child))
        return
    for case in CASES:
        if not common.wanted(options, case.name) or (options.quick and not options.only and case.name not in QUICK):
            continue
        solvers = tuple(options.solvers or ("default", *(STIFF if case.is_stiff else SMOOTH)))
        solvers, tolerances = (solvers[:1], DECADES[:2]) if options.quick else (solvers, DECADES)
        runs = list(runs_of(case, solvers, tolerances, 1 if options.quick else 3, options.quick))
        print(table(runs), decades(runs, (*solvers, "Exudyn", "MuJoCo")), sep="\n", flush=True)
        rows += rows_of(runs)
        for error in options.first:
            rows += first_rows(case, runs, solvers, error)
    common.report(rows, options)


if __name__ == "__main__":
    main()
