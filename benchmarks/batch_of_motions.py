"""Studies of many designs with `batch`: 10 000 four-bars of one second, 1 000 double wishbones of 61 poses.

Four-bars: lengths within 20 %, masses as large, one in ten cannot be assembled; 101 saved states and the peak load of
every pin.  Each program runs at its cheapest setting whose angles are within 1e-3, 1e-6 and 1e-9 rad for 95 % of the
designs (some pass close to a dead centre), ours at 21 of the saved times, the peer's at the end, against ours at
1e-11.  The peer is MuJoCo's threaded rollout of the designs that can be assembled: RK4, force sensors, models made
beforehand.  Its gradient is that of forward
differences: eight motions.  CPU seconds of all threads, compilation apart.

This runs in the environment of any user, without XLA_FLAGS; `--tuned` takes that of the other benchmarks.
"""

import os
import sys
import time

if "--tuned" not in sys.argv:
    os.environ["JAXMBS_BENCHMARK_ENVIRONMENT"] = "user"

import common  # noqa: I001
import double_wishbone
import four_bars
import jax
import numpy as np

import jaxmbs as mbs
from jaxmbs.batching import _batch as batches
from jaxmbs.batching._program import batched_function
from jaxmbs.runtime import tuning

TARGETS = (1e-3, 1e-6, 1e-9)
SETTINGS = {
    "Dopri5 over": (1e-3, 1e-4, 2e-5),
    "Dopri8 over": (1e-4, 1e-6, 1e-8, 1e-9, 1e-10),
    "Dopri8": (1e-6, 1e-8),
}
PEER_STEPS = (1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4)
CHUNKS = (16, 32, 64, 128)
THREADS = os.cpu_count() or 1


# --------------------------------------------------------------------------------------------------------- measuring
class Study:
    """A function for `batch`, compiled, with its CPU seconds of compilation."""

    def __init__(self, function, designs, chunk=None, **options):
        self.function, self.chunk, self.options = function, chunk, options
        start = time.process_time()
        self(jax.tree.map(lambda x: x[: chunk or THREADS * tuning.CHUNK], designs))
        self.compilation = time.process_time() - start

    def __call__(self, designs):
        """(batch, CPU seconds, wall seconds, bytes of memory at the peak above those at the start)."""
        before = _reset_peak()
        cpu, wall = time.process_time(), time.perf_counter()
        found = mbs.batch(self.function, designs, chunk=self.chunk, progress=False, **self.options)
        return found, time.process_time() - cpu, time.perf_counter() - wall, _memory("VmHWM") - before

    def lanes(self, number):
        """Designs in one chunk of a batch of so many."""
        return self.chunk or batches._chunk_size(number, THREADS)


def _memory(name):
    """A field of /proc/self/status [bytes]; 0 where there is none."""
    try:
        with open("/proc/self/status") as status:
            return next(1024 * int(line.split()[1]) for line in status if line.startswith(name))
    except (OSError, StopIteration):
        return 0


def _reset_peak():
    """Forget the largest resident memory so far; the present one [bytes]."""
    try:
        with open("/proc/self/clear_refs", "w") as file:
            file.write("5")
    except OSError:
        pass
    return _memory("VmRSS")


def _rows(table, rtol):
    return {"bars": table, "rtol": np.full(len(table["crank"]), rtol)}


def _grouped(values=lambda found: found):
    """Options of `batch`: designs that can be assembled, grouped by the steps they take."""
    return {"feasible": four_bars.feasible, "cost": lambda found: values(found)["steps"]}


def _error(found, reference, ok):
    """Largest error [rad] of 95 % of the designs, of angles (designs, ..., 3)."""
    gap = np.abs((found - reference + np.pi) % (2.0 * np.pi) - np.pi).reshape(len(found), -1).max(axis=1)
    return float(np.quantile(gap[ok], 0.95))


# ---------------------------------------------------------------------------------------------------------- four-bars
def _candidates(table, quick):
    """(solver, rtol, error, CPU seconds per motion) of our settings on few designs, a reference, the studies."""
    settings = {"Dopri5 over": SETTINGS["Dopri5 over"][:1]} if quick else SETTINGS
    studies = {solver: Study(four_bars.study(solver), _rows(table, 1e-6), **_grouped()) for solver in settings}
    reference = list(studies.values())[-1](_rows(table, 1e-11))[0].values
    found = []
    for solver, tolerances in settings.items():
        for rtol in tolerances:
            values, cpu, *_ = studies[solver](_rows(table, rtol))
            error = _error(values.values["path"], reference["path"], reference["ok"])
            found.append((solver, rtol, error, cpu / reference["ok"].sum()))
    return found, reference, studies


def _peers(table, reference, quick):
    """(step, error, CPU seconds per motion) of MuJoCo on a few designs."""
    ok = reference["ok"]
    table, start, end = ({k: v[ok] for k, v in table.items()}, reference["start"][ok], reference["path"][ok, 0])
    end = np.column_stack([end[:, 0], end[:, 1], end.sum(axis=1)])  # the rocker's own angle
    found = []
    for dt in PEER_STEPS[:2] if quick else PEER_STEPS:
        call = four_bars.rolled_out(table, start, dt, THREADS)
        cpu = time.process_time()
        last, _ = call()
        found.append((dt, _error(last, end, slice(None)), (time.process_time() - cpu) / ok.sum()))
    return found


def _cheapest(runs, target):
    """The cheapest run, (..., error, seconds), that meets the target; else None."""
    good = [run for run in runs if run[-2] <= target]
    return min(good, key=lambda run: run[-1]) if good else None


def four_bar_rows(options):
    few, many = (16, 16) if options.quick else (256, 10_000)  # one size of chunk, compiled once
    table = four_bars.table(many)
    sample = {name: column[:few] for name, column in table.items()}
    ours, reference, studies = _candidates(sample, options.quick)
    peers = _peers(sample, reference, options.quick)
    rows = []
    for target in TARGETS[:1] if options.quick else TARGETS:
        best, peer = _cheapest(ours, target), _cheapest(peers, target)
        if best is not None:
            rows += _study_rows(table, studies[best[0]], best, peer, target)
    best, peer = _cheapest(ours, 1e-3), _cheapest(peers, 1e-3)
    if best is not None and common.wanted(options, "four-bars gradient"):
        rows += _gradient_rows(table, best, peer, options.quick)
    if best is not None and common.wanted(options, "four-bars step"):
        rows += _step_rows(sample, best, CHUNKS[:1] if options.quick else CHUNKS)
    return rows


def _study_rows(table, study, best, peer, target):
    """Rows of all designs at one accuracy."""
    solver, rtol, error, _ = best
    found, cpu, wall, memory = study(_rows(table, rtol))
    motions, number = int(found.values["ok"].sum()), len(table["crank"])
    needed = np.sum(found.cost, where=found.ok)
    name, label, theirs = f"four-bars {target:.0e} rad", None, (None, None)
    if peer is not None:
        ok = found.values["ok"]
        call = four_bars.rolled_out({k: v[ok] for k, v in table.items()}, found.values["start"][ok], peer[0], THREADS)
        clocks = time.process_time(), time.perf_counter()
        _, peaks = call()
        theirs = time.process_time() - clocks[0], time.perf_counter() - clocks[1]
        label = f"MuJoCo RK4, step {peer[0]:g}"
    each = lambda seconds: None if seconds is None else 1e3 * seconds / motions
    rows = [
        common.row(name, f"CPU per motion, {solver} {rtol:g}", each(cpu), "ms", label, each(theirs[0]), "<= 1"),
        common.row(name, "wall per motion", each(wall), "ms", label, each(theirs[1])),
        common.row(name, "error of 95 % of the designs", error, "rad", label, peer and peer[1]),
        common.row(name, "designs that can be assembled", motions / number),
        common.row(name, "compilation, CPU", study.compilation, "s"),
        common.row(name, "working memory", memory / 2**20, "MiB"),
        common.row(name, "lane steps computed / needed", found.computed / needed, goal="< 1.3"),
        common.row(name, "CPU per lane step", 1e6 * cpu / found.computed, "us"),
    ]
    if peer is not None:
        gap = np.median(np.abs(peaks / found.values["peaks"][ok] - 1.0))
        rows.append(common.row(name, "median difference of the peak loads", gap))
    return rows


def _gradient_rows(table, best, peer, quick):
    """Rows of the gradient of the largest load by the seven lengths and masses."""
    solver, rtol, *_ = best
    slopes = jax.value_and_grad(four_bars.largest(solver), has_aux=True)
    number = 16 if quick else 2000
    few = _rows({k: v[:number] for k, v in table.items()}, rtol)
    study = Study(lambda row: slopes(row["bars"], row["rtol"]), few, **_grouped(lambda found: found[0][1]))
    found, cpu, wall, memory = study(few)
    (_, values), _ = found.values
    motions, name = int(values["ok"].sum()), "four-bars gradient"
    label, theirs = (None, None) if peer is None else (f"MuJoCo, 8 motions of {peer[0]:g}", 8e3 * peer[2])
    return [
        common.row(name, f"CPU per motion, {solver} {rtol:g}", 1e3 * cpu / motions, "ms", label, theirs, "<= 1"),
        common.row(name, "wall per motion", 1e3 * wall / motions, "ms"),
        common.row(name, "compilation, CPU", study.compilation, "s"),
        common.row(name, "working memory", memory / 2**20, "MiB"),
        common.row(name, "designs with a finite gradient / assembled", float(found.ok.sum() / motions)),
    ]


def _step_rows(table, best, chunks):
    """The motion without any load, how the chunk changes its cost, and a step without start and samples."""
    solver, rtol, *_ = best
    rows = []
    for chunk in chunks:
        study = Study(four_bars.motion_only(solver), _rows(table, rtol), chunk, **_grouped())
        found, cpu, *_ = study(_rows(table, rtol))
        metric = f"CPU per lane step, motion alone, chunks of {chunk}"
        rows.append(common.row("four-bars step", metric, 1e6 * cpu / found.computed, "us"))

    def lanes(rtol):
        found, cpu, wall, _ = study(_rows(table, rtol))
        return cpu, wall, found.computed

    alone = jax.jit(four_bars.motion_only(solver))
    good = int(np.argmax(found.values["ok"]))
    first = jax.tree.map(lambda column: column[good], _rows(table, rtol))

    def one(rtol):
        cpu, wall = time.process_time(), time.perf_counter()
        found = jax.block_until_ready(alone({**first, "rtol": rtol}))
        return time.process_time() - cpu, time.perf_counter() - wall, int(found["steps"])

    for metric, run, goal in ((f"lane step, chunks of {chunks[-1]}", lanes, "<= 40"), ("step alone", one, "<= 150")):
        cpu, wall = _slopes(run)
        rows.append(common.row("four-bars step", f"CPU of one more {metric}", cpu, "us", goal=goal))
        rows.append(common.row("four-bars step", f"wall of one more {metric}", wall, "us"))
    return rows


def _slopes(run, coarse=1e-4, fine=1e-9, repeats=5):
    """(CPU, wall) [us] of one more step: runs at two tolerances, each at its least time."""
    run(coarse)  # compiles
    ends = [np.min([run(rtol) for _ in range(repeats)], axis=0) for rtol in (coarse, fine)]
    return 1e6 * (ends[1] - ends[0])[:2] / (ends[1] - ends[0])[2]


# --------------------------------------------------------------------------------------------------- double wishbones
def wishbone_rows(options):
    number = 2 if options.quick else 1000
    points = double_wishbone.table(number)
    travels = double_wishbone.TRAVELS[:2] if options.quick else double_wishbone.TRAVELS
    loads = double_wishbone.study(travels)
    gap = double_wishbone.check()
    rows = [common.row("double wishbones", "largest error of the six loads in case V2", gap, "N", goal="< 1e-6")]
    slopes = jax.value_and_grad(lambda p: jax.numpy.max(jax.numpy.abs(loads(p))))
    for metric, function in (("loads", loads), ("largest load and gradient", slopes)):
        study = Study(function, points)
        found, cpu, wall, memory = study(points)
        chunk = batched_function(function, points).program_within_memory(study.lanes(number))[1]
        rows += [
            common.row("double wishbones", f"{metric}: CPU per design", 1e3 * cpu / number, "ms"),
            common.row("double wishbones", f"{metric}: wall per design", 1e3 * wall / number, "ms"),
            common.row("double wishbones", f"{metric}: compilation, CPU", study.compilation, "s"),
            common.row("double wishbones", f"{metric}: working memory", memory / 2**20, "MiB"),
            common.row("double wishbones", f"{metric}: designs in a chunk", chunk),
            common.row("double wishbones", f"{metric}: designs that succeeded", float(found.ok.mean())),
        ]
    return rows


def main():
    parser = common.parser(__doc__, "four-bars", "four-bars gradient", "four-bars step", "double wishbones")
    parser.add_argument("--tuned", action="store_true", help="the environment of the other benchmarks")
    options = parser.parse_args()
    rows = []
    if any(common.wanted(options, name) for name in ("four-bars", "four-bars gradient", "four-bars step")):
        rows += four_bar_rows(options)
    if common.wanted(options, "double wishbones"):
        rows += wishbone_rows(options)
    common.report(rows, options)


if __name__ == "__main__":
    main()
