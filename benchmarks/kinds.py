"""One and many things of each kind in a machine: equations of accelerations and motions, and the first motion.

The machines are those of `tests/test_program_size.py`, whose ceilings hold the equations.  "First motion" is a
tenth of a second from the assembled state of one thing, traced, compiled ("full") and run, in CPU seconds after the
caches of JAX are cleared.
"""

import sys
import time
from pathlib import Path

import common
import jax
import numpy as np

import jaxmbs as mbs

sys.path.insert(0, str(Path(__file__).parent.parent))
from tests.test_program_size import KINDS, QUESTIONS, asked, equations  # noqa: E402


def first_motion(build):
    system = build(1)
    start = mbs.State.at(system)
    jax.clear_caches()
    begin = time.process_time()
    jax.block_until_ready(mbs.simulate(system, start, ts=np.array([0.0, 0.1])))
    return time.process_time() - begin


def kind_rows(kind, quick):
    build, many, *_ = KINDS[kind]
    systems = build(1), build(many)
    rows = []
    for name in ("forward dynamics", "simulate"):
        one, more = (equations(*asked(system, mbs.State.at(system), QUESTIONS[name])) for system in systems)
        rows.append(common.row(kind, f"{name}, {many} things", more, "equations", "one thing", one))
    return rows if quick else [*rows, common.row(kind, "first motion", first_motion(build), "s CPU")]


CASES = {kind: lambda quick, kind=kind: kind_rows(kind, quick) for kind in KINDS}


if __name__ == "__main__":
    common.run_cases(__doc__, CASES)
