"""The notebooks in their fast mode, a cold process each, beside those of another commit.

CPU seconds of the whole process, imports and threads of the compiler included; without a store.
`--before COMMIT` runs the scripts of the same names of that commit with its library.
"""

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

os.environ["JAXMBS_BENCHMARK_ENVIRONMENT"] = "user"

import common  # noqa: I001, E402

ROOT = Path(__file__).parent.parent
NAMES = sorted(path.stem for path in (ROOT / "notebooks").glob("*.py"))


def seconds(root, name):
    """CPU seconds of one script of a checkout; None where it fails or is not there."""
    environment = {
        **os.environ,
        "PYTHONPATH": str(root),
        "JAXMBS_FAST": "1",
        "MPLBACKEND": "Agg",
        "JAXMBS_STORE": "off",
    }
    for variable in ("XLA_FLAGS", "JAXMBS_COMPILE", "PYTHONDONTWRITEBYTECODE"):
        environment.pop(variable, None)
    used = lambda: sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
    begin, command = used(), [sys.executable, str(root / "notebooks" / f"{name}.py")]
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=folder)
    if done.returncode:
        print(f"{name} of {root}: {done.stderr.strip().splitlines()[-1]}", file=sys.stderr)
    return None if done.returncode else used() - begin


def main():
    parser = common.parser(__doc__, *NAMES)
    parser.add_argument("--before", **common.BEFORE)
    options = parser.parse_args()
    names = [name for name in NAMES if common.wanted(options, name)][: 1 if options.quick else None]
    rows = []
    with common.checkout(options.before) as before:
        for name in names:
            theirs = seconds(before, name) if before else None
            if (ours := seconds(ROOT, name)) is not None:
                rows.append(common.row(name, "process", ours, "s CPU", options.before, theirs))
            print(f"{name} done", flush=True)
    both = [row for row in rows if row.peer_value]
    if both:
        ours, theirs = sum(row.value for row in both), sum(row.peer_value for row in both)
        rows.append(common.row("all", "processes", ours, "s CPU", options.before, theirs, "<= 0.35 of the peer"))
    common.report(rows, options)


if __name__ == "__main__":
    main()
