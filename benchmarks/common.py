"""What the benchmarks share: arguments, timing in CPU seconds, rows, tables and JSON.

Import this before anything that imports JAX or NumPy: `environment` sets what they read at import.
"""

import argparse
import contextlib
import importlib.metadata
import json
import os
import platform
import statistics
import subprocess
import tempfile
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path

import environment  # noqa: F401
import jax

from jaxmbs.runtime import compile_kind
from jaxmbs.runtime._compiler_options import compiler_options

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_enable_compilation_cache", False)  # compile times are measured, never read from disk

PACKAGES = ("jaxmbs", "jax", "jaxlib", "equinox", "diffrax", "numpy", "pin", "mujoco", "exudyn", "pyyeti", "rainflow")


@dataclass(frozen=True)
class Row:
    """One figure: ours, the peer's if any, and ours over the peer's.  The goal is printed, not stored."""

    case: str
    metric: str
    value: float | int | str
    unit: str = ""
    peer: str | None = None
    peer_value: float | None = None
    ratio: float | None = field(default=None)
    goal: str = field(default="", compare=False)


def row(case, metric, value, unit="", peer=None, peer_value=None, goal=""):
    """A row, its ratio filled in."""
    if not isinstance(value, str | int):
        value = float(value)
    peer_value = None if peer_value is None else float(peer_value)
    ratio = value / peer_value if peer_value else None
    return Row(case, metric, value, unit, peer, peer_value, ratio, goal)


def parser(description, *names):
    """Argument parser with the options of every benchmark; `names` are the cases that `--only` takes."""
    p = argparse.ArgumentParser(description=description.splitlines()[0])
    p.add_argument(
        "--quick", action="store_true", help="small cases and few repeats: a check that it runs, no figures"
    )
    p.add_argument("--json", metavar="FILE", help="write the rows to this file")
    if names:
        p.add_argument("--only", nargs="+", metavar="CASE", help=f"run these cases only: {', '.join(names)}")
    return p


def wanted(options, name):
    """Whether `--only` lets the case run."""
    begins = lambda pattern: name == pattern or name.startswith((f"{pattern} ", f"{pattern},"))
    return not options.only or any(map(begins, options.only))


BEFORE = {"metavar": "COMMIT", "help": "a commit to compare with"}


@contextlib.contextmanager
def checkout(commit):
    """A folder with the files of a commit; None for None."""
    if commit is None:
        yield None
        return
    git = ["git", "-C", str(Path(__file__).parent), "worktree"]
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([*git, "add", "--detach", folder, commit], check=True, capture_output=True)
        try:
            yield Path(folder)
        finally:
            subprocess.run([*git, "remove", "--force", folder], check=True, capture_output=True)


def run_cases(description, cases):
    """Run the cases that were asked for, rows of a table by name, and report them."""
    options = parser(description, *cases).parse_args()
    found = []
    for name, rows in cases.items():
        if wanted(options, name):
            found += rows(options.quick)
            print(f"{name} done", flush=True)
    report(found, options)


# --------------------------------------------------------------------------------------------------------- timing
def cpu_seconds(functions, rounds=5, least=0.2):
    """Median CPU seconds of one call of each function of a dict, all threads of the process counted.

    The functions take turns, so that a slow spell of the machine meets all of them; each turn repeats its function
    for about `least` seconds.  The first call is the warm-up.
    """
    counts = {}
    for name, function in functions.items():
        jax.block_until_ready(function())
        once = timed(function, 1)
        counts[name] = max(1, int(least / max(once, 1e-7)))
    times = {name: [] for name in functions}
    for _ in range(rounds):
        for name, function in functions.items():
            times[name].append(timed(function, counts[name]) / counts[name])
    return {name: statistics.median(values) for name, values in times.items()}


def timed(function, count):
    start = time.process_time()
    for _ in range(count):
        result = function()
    jax.block_until_ready(result)
    return time.process_time() - start


def compiled(function, *args, often=False):
    """The compiled function and the CPU seconds of tracing, lowering and compiling it, from cold, as `mbs.jit` does;
    often: as `mbs.batch` does its batches."""
    jax.clear_caches()
    start = time.process_time()
    with compile_kind("full"):
        lowered = jax.jit(function).lower(*args)
    executable = lowered.compile(compiler_options("full", jax.default_backend(), often))
    return executable, time.process_time() - start


def compile_seconds(functions, rounds=3):
    """Median CPU seconds of `compiled` of each (function, *arguments) of a dict, which take turns."""
    times = {name: [] for name in functions}
    for _ in range(rounds):
        for name, (function, *arguments) in functions.items():
            times[name].append(compiled(function, *arguments)[1])
    return {name: statistics.median(values) for name, values in times.items()}


# ---------------------------------------------------------------------------------------------------------- output
def versions():
    """Rows that say what was measured where."""
    found = {"machine": f"{_processor()}, {os.cpu_count()} cores", "python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            continue
    found["XLA_FLAGS"] = os.environ.get("XLA_FLAGS", "")
    return [row(name, "version", value) for name, value in found.items()]


def _processor():
    try:
        with open("/proc/cpuinfo") as info:
            return next(line.split(":", 1)[1].strip() for line in info if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def _text(value):
    if value is None:
        return ""
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def table(rows):
    """The rows as aligned text."""
    heads = ("case", "metric", "ours", "unit", "peer", "peer's", "ratio", "goal")
    cells = [tuple(_text(getattr(r, name)) for name in Row.__dataclass_fields__) for r in rows]
    widths = [max(len(line[i]) for line in (heads, *cells)) for i in range(len(heads))]
    lines = ["  ".join(c.ljust(w) for c, w in zip(line, widths, strict=True)).rstrip() for line in (heads, *cells)]
    return "\n".join(lines)


def report(rows, options):
    """Print the table; write the JSON list if asked for, beside the rows of the file that `--only` left out."""
    print(table(rows))
    if options.json:
        measured = [{k: v for k, v in asdict(r).items() if k != "goal"} for r in (*versions(), *rows)]
        path = Path(options.json)
        before = json.loads(path.read_text()) if getattr(options, "only", None) and path.exists() else []
        names = {(r["case"], r["metric"]) for r in measured}
        everything = [*measured, *(r for r in before if (r["case"], r["metric"]) not in names)]
        path.write_text(json.dumps(everything, indent=1) + "\n")
        print(f"wrote {options.json}")
