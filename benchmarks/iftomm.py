"""The rigid cases of the IFToMM multibody benchmark library in its own error measure, and its submission form.

Cases A01 to A05 of Gonzalez, Dopico, Lugris, Cuadrado (2006), "A benchmarking system for MBS simulation software".
Error of the coordinate j at the time t_i: |y - y_ref| / max(|y_ref|, threshold); of a run: the root of the mean of
its square over all times and coordinates.  Our choice: thresholds of 1e-2 of the coordinate's range, 101 equally
spaced times.  Targets are the library's low and high precision (1e-1, 1e-3), and 1e-6.  For each, the cheapest run of
a short list that meets it, beside Exudyn's; a run reads its coordinates at the times too.  CPU time, compilation
apart.

References: A01 elliptic functions; A02 and A04 one exact equation by SciPy's DOP853 at 1e-13; A03 and A05 our own
motions at 1e-12 and 1e-11, which `tests/cases` compares with published digits.

`--submit FOLDER` writes the fields of the library's form and the coordinates of the cheapest run of high precision.
"""

import importlib.util
import platform
import statistics
from dataclasses import dataclass, field
from pathlib import Path

import common
import numpy as np
from iftomm_cases import CASES

import jaxmbs as mbs
from jaxmbs.status import succeeded

TARGETS = (1e-1, 1e-3, 1e-6)
HIGH_PRECISION = 1e-3
QUICK = ("A01",)
LONG_RUN = 1.0  # CPU seconds; such runs are not repeated
PEER = "Exudyn"


@dataclass(frozen=True)
class Run:
    """One run: error in the library's measure, CPU seconds, its coordinates (T, J), largest drift of the energy over
    the range of the kinetic energy (ours only)."""

    method: str
    setting: str
    error: float
    seconds: float
    path: np.ndarray = field(repr=False)
    drift: float | None = None

    def __str__(self):
        return f"{self.method} {self.setting} (error {self.error:.1e})"


# --------------------------------------------------------------------------------------------------------- measure
def error_of(path, reference):
    """Error of the coordinates (T, J) in the library's measure."""
    threshold = 1e-2 * np.ptp(reference, axis=0)
    relative = (path - reference) / np.maximum(np.abs(reference), threshold)
    return float(np.sqrt(np.mean(relative**2)))


def seconds_of(function, rounds):
    """Median CPU seconds of a call; a long one is not repeated."""
    first = common.timed(function, 1)
    if first > LONG_RUN:
        return first
    return statistics.median([first, *(common.timed(function, 1) for _ in range(rounds - 1))])


# ------------------------------------------------------------------------------------------------------------ runs
def our_runs(case, reference, options):
    """Runs of each method from coarse to fine up to the smallest target, and CPU seconds of compilation by method."""
    system = case.build()
    start, read = case.start(system), case.reader(system)
    runs, compile_times = [], {}
    for method in case.methods:

        def simulate(value, method=method):
            motion = mbs.simulate(system, start, ts=case.ts, throw=False, **method.options(value))
            accounts = motion.diagnostics
            return read(motion.states), motion.result, accounts.energy_residual, accounts.kinetic

        program = mbs.jit(simulate)
        first = common.timed(lambda program=program, method=method: program(method.values[0]), 1)
        for value in method.values[-1:] if options.quick else method.values:
            seconds = seconds_of(lambda program=program, value=value: program(value), 1 if options.quick else 5)
            compile_times.setdefault(method.name, max(0.0, first - seconds))
            path, result, residual, kinetic = map(np.asarray, program(value))
            if not succeeded(result):
                print(f"{case.name} {method.name} {method.setting(value)}: {mbs.Status(int(result))}", flush=True)
                continue
            drift = float(np.max(np.abs(residual)) / np.ptp(kinetic)) if case.conservative else None
            runs.append(Run(method.name, method.setting(value), error_of(path, reference), seconds, path, drift))
            if runs[-1].error <= TARGETS[-1]:
                break
    return runs, compile_times


def exudyn_runs(case, reference, options):
    """Runs of each method of Exudyn from coarse to fine up to the smallest target or the budget."""
    if importlib.util.find_spec("exudyn") is None:
        return []
    import iftomm_exudyn

    columns, runs = ["xyz".index(name) for name in case.columns], []
    model = case.peer(iftomm_exudyn)
    for method in case.peer_methods:
        for step in case.peer_steps:

            def solve(method=method, step=step):
                return iftomm_exudyn.path(model, method, step, case.ts, **case.peer_options)

            try:
                times, path = solve()
            except RuntimeError as error:
                print(f"{case.name} {PEER} {method} h={step:g}: {str(error).splitlines()[0]}", flush=True)
                continue
            seconds = seconds_of(solve, 1 if options.quick else 5)
            late = np.max(np.abs(times - case.ts)) > 1e-6 * case.ts[-1]
            error = error_of(path[:, columns], case.reference(case, times) if late else reference)
            runs.append(Run(f"{PEER} {method}", f"h={step:.0e}", error, seconds, path))
            if options.quick or runs[-1].error <= TARGETS[-1] or 2.5 * seconds > options.budget:
                break
    return runs


def cheapest(runs, target):
    """The cheapest run that meets the target; None where none does."""
    enough = [run for run in runs if run.error <= target]
    return min(enough, key=lambda run: run.seconds, default=None)


# ---------------------------------------------------------------------------------------------------------- output
def rows_of(case, ours, compile_times, peers):
    """Rows of a case: the cheapest runs by target, compilation, drift of the energy."""
    rows, chosen = [], []
    for target in TARGETS:
        run, peer = cheapest(ours, target), cheapest(peers, target)
        if run is None:
            continue
        chosen.append(run)
        theirs = (str(peer), peer.seconds) if peer else ()
        rows.append(common.row(case.name, f"error below {target:.0e}, {run}", run.seconds, "s CPU", *theirs))
        if run.drift is not None:
            rows.append(common.row(case.name, f"error below {target:.0e}, energy drift", run.drift, "1"))
    for method in dict.fromkeys(run.method for run in chosen):
        rows.append(common.row(case.name, f"compile, {method}", compile_times[method], "s CPU"))
    if peers:
        best = min(peers, key=lambda run: run.error)
        rows.append(common.row(case.name, f"smallest error of {best.method} {best.setting}", best.error, "1"))
    return rows


def table(case, runs):
    """All runs of a case as text."""
    line = "{:10}  {:28}  {:10}  {:>9}  {:>9}  {:>9}".format
    lines = [line("case", "method", "setting", "error", "CPU s", "drift")]
    for run in runs:
        drift = "" if run.drift is None else f"{run.drift:.1e}"
        lines.append(line(case.name, run.method, run.setting, f"{run.error:.1e}", f"{run.seconds:.3g}", drift))
    return "\n".join(lines)


def submit(folder, case, run, compile_seconds):
    """Write the form and the coordinates of a run: `A01.txt`, `A01_results.txt`."""
    folder.mkdir(parents=True, exist_ok=True)
    versions = {row.case: row.value for row in common.versions()}
    method = (
        f"jaxmbs {versions['jaxmbs']} on JAX {versions['jax']}: joint coordinates, loops closed by constraints "
        f"(canonical momenta, projection at each step); {run.method}, {run.setting}; double precision, one core; "
        f"compilation, {compile_seconds:.2g} s once, is not in the CPU time"
    )
    fields = {
        "Problem": case.problem,
        "Authors": "jaxmbs developers",
        "Accuracy": f"{run.error:.2e}",
        "CPU time": f"{run.seconds:.4g} s",
        "CPU/GPU": versions["machine"],
        "Operating system": f"{platform.system()} {platform.machine()}",
        "Method description": method,
    }
    stem = case.name.replace(" ", "_").replace("=", "")
    (folder / f"{stem}.txt").write_text("".join(f"{name}: {text}\n" for name, text in fields.items()), "ascii")
    header = " ".join(("time", *(f"{case.point}_{column}" for column in case.columns)))
    values = np.column_stack([case.ts, run.path])
    np.savetxt(folder / f"{stem}_results.txt", values, "%.12e", header=header, comments="")


def main():
    parser = common.parser(__doc__, *(case.name for case in CASES))
    parser.add_argument("--submit", type=Path, metavar="FOLDER", help="write the library's form for each case here")
    parser.add_argument("--budget", type=float, default=20.0, help="CPU seconds of one run of Exudyn, about (20)")
    options, rows = parser.parse_args(), []
    for case in CASES:
        if not common.wanted(options, case.name) or (options.quick and not options.only and case.name not in QUICK):
            continue
        reference = case.reference(case, case.ts)
        ours, compile_times = our_runs(case, reference, options)
        peers = exudyn_runs(case, reference, options)
        print(table(case, ours + peers), flush=True)
        rows += rows_of(case, ours, compile_times, peers)
        run = cheapest(ours, HIGH_PRECISION)
        if options.submit and run:
            submit(options.submit, case, run, compile_times[run.method])
    common.report(rows, options)


if __name__ == "__main__":
    main()
