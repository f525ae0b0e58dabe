"""From import to answer: CPU seconds, programs, equations and bytes of cold processes, beside another commit.

"import: CPU" is that of JAX, equinox and jaxmbs; "first names" are the files of the library that the case names.

Each case is a process of its own without XLA_FLAGS and without a cache, but for "second process" (what
`jaxmbs.cache` kept of a first one) and "stored program" (`jaxmbs.runtime.export`, with that cache).
`--before COMMIT` runs the same cases with that commit's library; each figure is the least of `--repeats` processes.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

os.environ["JAXMBS_BENCHMARK_ENVIRONMENT"] = "user"

import common  # noqa: I001, E402
import json

HERE = Path(__file__).parent
GOALS = {
    ("import", "import: CPU"): "<= 1.5",
    ("import", "import of jaxmbs: CPU"): "<= 0.6",
    ("equilibrium, three links", "equilibrium: CPU"): "<= 5",
    ("equilibrium, five links", "equilibrium: CPU"): "<= 8",
    ("lift", "tolerances: CPU"): "<= 20",
    ("press", "minimise: CPU"): "<= 60",
    ("pendulum", "import to reactions: CPU"): "<= 5",
    ("four-bar", "import to reactions: CPU"): "<= 8",
    ("four-bar", "programs from import to reactions"): "<= 6",
    ("four-bar", "another length: CPU"): "<= 0.5",
    ("four-bar", "gradient: CPU"): "<= 15",
    ("four-bar", "memory of the process"): "<= 700",
    ("four-bar quick", "import to reactions: CPU"): "<= 5",
    ("four-bar quick", "gradient: CPU"): "<= 12",
    ("second process", "import to reactions: CPU"): "<= 3.5",
    ("second process", "gradient: CPU"): "<= 4.5",
    ("stored program", "stored, value: CPU"): "<= 1.5",
    ("stored program", "stored, gradient: CPU"): "<= 2.5",
    ("sizes", "forward dynamics: equations"): "<= 1300",
    ("sizes", "simulate: equations"): "<= 3800",
    ("sizes", "reactions: equations"): "<= 2000",
    ("sizes", "linearise: equations"): "<= 6000",
    ("sizes", "stiffness: equations"): "<= 4000",
    ("sizes", "kic: equations"): "<= 600",
    ("sizes", "whole gradient: equations"): "<= 18000",
    ("peak", "peak: CPU"): "<= 10",
    ("driven arm", "gradient of a peak: CPU"): "<= 15",
    ("implicit", "implicit motion: CPU"): "<= 5",
    ("cube", "modes: CPU"): "<= 5",
    ("four-bar, jax.jit", "gradient: CPU"): "<= 20",
}
CASES = {  # of this table: (first process or None, the one that is measured)
    "import": ("import", "import"),  # the first one writes the .pyc
    "equilibrium, three links": (None, "equilibrium 3"),
    "equilibrium, five links": (None, "equilibrium 5"),
    "lift": (None, "lift"),
    "press": (None, "press"),
    "pendulum": (None, "pendulum"),
    "four-bar": (None, "four-bar"),
    "four-bar quick": (None, "quick"),
    "four-bar, jax.jit": (None, "plain"),
    "second process": ("cached", "cached"),
    "stored program": ("store", "stored"),
    "sizes": (None, "sizes"),
    "README": (None, "readme"),
    "crane": (None, "crane"),
    "exact beams": (None, "beams"),
    "elastic four-bar": (None, "elastic"),
    "wheel on a road": (None, "wheel"),
    "random test": (None, "random"),
    "sweep": (None, "sweep"),
    "planar body": (None, "body"),
    "peak": (None, "peak"),
    "driven arm": (None, "arm"),
    "implicit": (None, "implicit"),
    "cube": (None, "cube"),
    **{f"motion of {name}": (None, f"motion of {name}") for name in ("four_bar", "press", "hydraulic", "cables")},
    "Atwood's machine": (None, "rows: atwood"),
    "four-bar without friction": (None, "rows: 0"),
    "four-bar, two joints rub": (None, "rows: 2"),
    "three cranks, six joints rub": (None, "rows: cranks"),
    **{f"singular poses, {n} loops": (None, f"singular {n}") for n in (10, 40, 160)},
}
UNITS = {
    "CPU": "s",
    "equations": "",
    "bytes": "",
    "run": "ms",
    "memory of the process": "MiB",
    "error of the angle": "rad",
    "error of the velocity": "rad/s",
    "steps": "",
}


def ask(library: Path, child: str, folder: str):
    """Figures of one process with the library that stands in a folder; None where it lacks what is asked."""
    environment = {**os.environ, "PYTHONPATH": str(library), "JAXMBS_STORE": str(Path(folder) / "programs")}
    for name in ("XLA_FLAGS", "JAXMBS_COMPILE", "PYTHONDONTWRITEBYTECODE"):
        environment.pop(name, None)
    command = [sys.executable, str(HERE / "cold_child.py"), child, folder]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    if done.returncode:
        print(f"{child} with {library}: {done.stderr.strip().splitlines()[-1]}", file=sys.stderr)
        return None
    figures = json.loads(done.stdout.splitlines()[-1])
    if figures.get("files without .pyc"):
        print(f"{child} with {library}: {done.stderr.strip().splitlines()[-1]}", file=sys.stderr)
    return figures


def least(library: Path, case: str, repeats: int):
    """The least of every figure over some processes."""
    first, child = CASES[case]
    with tempfile.TemporaryDirectory() as folder:
        if first and ask(library, first, folder) is None:
            return None
        folders = (folder if first else str(Path(folder) / str(k)) for k in range(1 if case == "sizes" else repeats))
        found = [ask(library, child, each) for each in folders]
    return None if None in found else {name: min(each[name] for each in found) for name in found[0]}


def rows_of(case, ours, theirs, before):
    unit = lambda name: next((u for end, u in UNITS.items() if name.endswith(end)), "")
    peer = (lambda name: (before, theirs.get(name))) if theirs else (lambda name: (None, None))
    goal = lambda name: GOALS.get((case, name), "")
    return [common.row(case, name, figure, unit(name), *peer(name), goal(name)) for name, figure in ours.items()]


def main():
    parser = common.parser(__doc__, *CASES)
    parser.add_argument("--before", **common.BEFORE)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    cases = [case for case in CASES if common.wanted(options, case)]
    cases, repeats = (["pendulum"], 1) if options.quick else (cases, options.repeats)
    rows = []
    with common.checkout(options.before) as before:
        for case in cases:
            ours = least(HERE.parent, case, repeats)
            theirs = least(before, case, repeats) if before else None
            rows += rows_of(case, ours or {}, theirs, options.before)
    common.report(rows, options)


if __name__ == "__main__":
    main()
