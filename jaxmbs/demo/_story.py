"""The demo from beginning to end."""

import sys
import time
from os import PathLike

import numpy as np

from .. import reactions, simulate
from . import _files as files
from . import _tables as tables
from ._improve import improve
from ._loads import crank_grid, select_times, simulate_drive
from ._mechanism import DESIGN, slider_crank, start
from ._reference import FREE_TIMES


def run(output: str | PathLike, quick: bool = False) -> int:
    """Simulate, check, improve and write; returns the exit status: 0, or 2 when the folder cannot be written.

    Args:
        output: folder for plots and tables; made when missing.
        quick: fewer crank angles and optimisation steps.
    """
    try:
        folder = files.open_folder(output)
    except OSError as error:
        print(f"demo: cannot write to the folder {str(output)!r}: {error.strerror or error}", file=sys.stderr)
        return 2
    step = _Steps(4)
    results = study(24 if quick else 72, 25 if quick else 40, step)
    step("writing tables and plots")
    for path in files.write(folder, results):
        print(f"  {path}")
    print(f"done in {time.perf_counter() - step.began:.0f} s")
    return 0


def study(size: int, steps: int, step=lambda text: None) -> dict:
    """All results of the demo, printed as they come.

    Args:
        size: crank angles over a turn.
        steps: largest number of optimisation steps.
        step: called with the heading of each part.
    """
    step("slider-crank at 50 rad/s: motion over one turn, joint loads (compiles first)")
    ts, even, at_reference = crank_grid(size)
    system, motion, every = simulate_drive(DESIGN, ts)
    print(system.describe())
    deviations = tables.deviations(select_times(every, at_reference))
    print("\n" + tables.reference_table(select_times(every, at_reference), deviations))

    step("the same mechanism running free, without torque and gas: energy audit")
    free = slider_crank(DESIGN, driven=False)
    free_times = np.unique(np.r_[np.linspace(0.0, 1.0, 101), FREE_TIMES])
    run_free = simulate(free, start(free, DESIGN, velocities={"main": 5.0}), ts=free_times)
    angle = np.asarray(free.coordinates(run_free.states)["main"])[np.searchsorted(free_times, FREE_TIMES)]
    deviations["free run"] = tables.free_deviation(angle)
    print(tables.energy_table(run_free, deviations["free run"]))

    step("counterweight, rod length and rod balance under limits, by gradients through motion and reactions")
    before = select_times(every, even)
    optimum = improve(system, before, size, steps)
    after_system, after_motion, every_after = simulate_drive(optimum.design, ts, like=system)
    after = select_times(every_after, even)
    print("\n" + optimum.table())
    print("\n" + tables.comparison_table(before, after))
    print("The objective is the mean of RMS shaking force and main bearing peak, each over its first value.")
    print("Wrist pin and motor are limits: a price is the change of the objective if the limit moves up by one unit.")
    return {
        "deviations": deviations,
        "optimum": optimum,
        "free": run_free,
        "systems": (system, after_system),
        "motions": (motion, after_motion),
        "reactions": (reactions(system, motion), reactions(after_system, after_motion)),
        "loads": (before, after),
    }


class _Steps:
    """Headings with the time since the first."""

    def __init__(self, total):
        self.total, self.done, self.began = total, 0, time.perf_counter()

    def __call__(self, text):
        self.done += 1
        spent = time.perf_counter() - self.began
        print(f"\n[{self.done}/{self.total}] {text}" + (f"  ({spent:.0f} s so far)" if spent > 1 else ""), flush=True)
