"""What the store of a study costs: 10 000 four-bars by `mbs.sweep` into a folder, against the same bare `mbs.batch`.

The two take turns in one process after each was compiled.  Prints a table; `--json FILE` writes it.
"""

import tempfile
import time
from pathlib import Path

import common
import four_bars
import numpy as np

import jaxmbs as mbs

RTOL = 1e-6


def question():
    """Function of a row of the table to what a study keeps of its motion."""
    study = four_bars.study("Dopri8 over")

    def answers(bars):
        found = study({"bars": bars, "rtol": RTOL})
        return {name: found[name] for name in ("path", "peaks", "steps", "ok")}

    return answers


def steps(found):
    """What a motion has cost."""
    return found["steps"]


def timed(call):
    """(wall seconds, CPU seconds) of a call."""
    wall, spent = time.perf_counter(), time.process_time()
    call()
    return time.perf_counter() - wall, time.process_time() - spent


def main():
    options = common.parser(__doc__).parse_args()
    number, turns = (256, 1) if options.quick else (10_000, 3)
    designs, answers = four_bars.table(number), question()

    def bare():
        mbs.batch(answers, designs, progress=False, cost=steps)

    def stored():
        with tempfile.TemporaryDirectory() as folder:
            mbs.sweep(answers, designs, Path(folder) / "study", progress=False, cost=steps)

    ways = {"bare": bare, "stored": stored}
    times = {name: [] for name in ways}
    for turn in range(turns + 1):  # the first compiles
        for name, call in ways.items():
            found = timed(call)
            if turn:
                times[name].append(found)
    wall, spent = ({name: np.median(np.array(x)[:, k]) for name, x in times.items()} for k in (0, 1))
    case = f"{number} four-bars"
    common.report(
        [
            common.row(case, "wall time with a store", wall["stored"], "s", "bare batch", wall["bare"], goal="1.10"),
            common.row(case, "CPU time with a store", spent["stored"], "s", "bare batch", spent["bare"], goal="1.10"),
        ],
        options,
    )


if __name__ == "__main__":
    main()
