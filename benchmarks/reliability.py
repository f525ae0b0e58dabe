"""Probabilities of failure of 26 published problems by every method of `design.reliability`, beside the references.

A method is right where it is within a factor of 1.5 of the reference; what it gets wrong and calls `ok` is counted:
an engineer would have believed it.
"""

import os
import time
import warnings

os.environ["JAXMBS_BENCHMARK_ENVIRONMENT"] = "user"  # cold: with the flags of benchmarks RP63 compiles for minutes

from common import parser, report, row  # first: sets what JAX reads at import

import numpy as np  # isort: skip
from reliability_problems import PROBLEMS

import jaxmbs as mbs

METHODS = ("form", "sorm", "importance", "subset")
SMALL = ("RP22", "RP31", "R-S")
FACTOR = 1.5


def main():
    options = parser(__doc__, *PROBLEMS).parse_args()
    warnings.simplefilter("ignore")
    rows, counts = [], {method: np.zeros(4) for method in METHODS}
    print(f"{'':16}{'reference':>11}" + "".join(f"{method:>14}" for method in METHODS) + "   over it; ! not ok")
    names = options.only or (SMALL if options.quick else PROBLEMS)
    for name in names:
        problem, cells = PROBLEMS[name], []
        for method in METHODS:
            begin = time.process_time()
            found = mbs.design.reliability(problem.limit_state, problem.variables(), method, compile="tape")
            seconds = time.process_time() - begin
            ratio = float(found.probability) / problem.probability
            right = 1.0 / FACTOR <= ratio <= FACTOR
            counts[method] += (right and found.ok, not found.ok, not right and found.ok, seconds)
            cells.append(f"{ratio:.3f}{'' if found.ok else ' !'}")
            if np.isfinite(found.probability):
                case = f"{name}, {method}"
                rows.append(row(case, "probability", found.probability, "", "reference", problem.probability))
                rows.append(row(case, "ok", int(found.ok)))
        print(f"{name:16}{problem.probability:11.3g}" + "".join(f"{cell:>14}" for cell in cells), flush=True)
    for method, (right, doubted, wrong, seconds) in counts.items():
        case = f"{len(names)} problems, {method}"
        rows.append(row(case, "right within 1.5 and ok", int(right)))
        rows.append(row(case, "said to be not ok", int(doubted)))
        rows.append(row(case, "wrong and ok", int(wrong), goal="0"))
        rows.append(row(case, "running, cold", seconds, "CPU s"))
    report(rows, options)


if __name__ == "__main__":
    main()
