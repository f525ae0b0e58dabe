"""Do the tests notice a wrong sign?  Each place of `mutants.toml` is changed in turn, and the tests named there run.

On copies of the tree in a temporary folder, never on the checkout.  Prints a table of the survivors; `--json FILE`
writes all; fails where one in the physics or in a derivative rule survives.

    python benchmarks/mutations.py --only march --jobs 2

A run of all takes hours; with `--go-on` it keeps what stands in `--json` of places that have not changed since.
"""

import argparse
import collections
import concurrent.futures
import json
import os
import queue
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

ROOT = Path(__file__).parent.parent
FATAL = ("physics", "derivative")
NO_TESTS = 5  # how pytest ends where the marks choose none
PYTEST = ("-x", "-q", "-p", "no:cacheprovider", "-n", "0", "--no-header", "--tb", "line")
MARKS = ("not slow and not long", "slow", "long")  # the quick tests first; apart, since these check types as well


def mutants():
    """All places, as dicts."""
    entries = tomllib.loads((ROOT / "benchmarks" / "mutants.toml").read_text(encoding="utf-8"))["mutant"]
    return [{"rule": "physics", **entry, "name": f"{entry['file']}: {entry['old']}"} for entry in entries]


def faults(entry) -> list[str]:
    """Why a place cannot be changed: its text is not there once, or a test is gone."""
    text = (ROOT / "jaxmbs" / entry["file"]).read_text(encoding="utf-8")
    found = [] if text.count(entry["old"]) == 1 else [f"{entry['name']}: occurs {text.count(entry['old'])} times"]
    for test in entry["tests"].split():
        file, _, function = test.partition("::")
        path = ROOT / "tests" / file
        if not path.exists() or (function and f"def {function.partition('[')[0]}(" not in path.read_text("utf-8")):
            found.append(f"{entry['name']}: there is no test {test}")
    return found


def copied(folder) -> Path:
    """A copy of what the tests need, with a cache of compiled programs of its own."""
    names = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in names.splitlines():
        if not name.startswith(("notebooks/", "docs/")) and (ROOT / name).exists():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, folder / name)
    machine = Path("jaxmbs/runtime/tape/machine.so")  # what the C compiler made at installation
    if (ROOT / machine).exists():
        shutil.copy(ROOT / machine, folder / machine)
    return folder


def judged(entry, folder, limit) -> dict:
    """What becomes of one mutant in a copy: "killed", "survived" or "timeout", by which test, after how long."""
    path = folder / "jaxmbs" / entry["file"]
    right = path.read_text(encoding="utf-8")
    begin, environment = time.perf_counter(), {**os.environ, "PYTHONPATH": str(folder), "OPENBLAS_NUM_THREADS": "1"}
    tests = [f"tests/{test}" for test in entry["tests"].split()]
    options = {"cwd": folder, "env": environment, "capture_output": True, "text": True, "timeout": limit}
    result, by = "survived", ""
    try:
        path.write_text(right.replace(entry["old"], entry["new"]), encoding="utf-8")
        for mark in MARKS:
            if result == "survived":
                command = [sys.executable, "-m", "pytest", *PYTEST, "-m", mark, *tests]
                result, by = _read(subprocess.run(command, **options))
    except subprocess.TimeoutExpired:
        result, by = "timeout", ""
    finally:
        path.write_text(right, encoding="utf-8")
    return {**entry, "result": result, "by": by, "seconds": round(time.perf_counter() - begin, 1)}


def _read(done):
    """(result, the test that noticed) of a run of pytest.  Raises: RuntimeError where nothing could be run."""
    failed = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    if done.returncode not in (0, 1, NO_TESTS) and not failed:
        raise RuntimeError(f"pytest ended with {done.returncode}:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    name = failed[0].split()[1].removeprefix("tests/") if failed else ""
    return ("survived" if done.returncode in (0, NO_TESTS) else "killed"), name


def run(entries, jobs, limit):
    """Results of all entries, each as it comes, on as many copies as jobs."""
    with tempfile.TemporaryDirectory(prefix="mutants") as folder:
        copies = queue.Queue()
        for k in range(jobs):
            copies.put(copied(Path(folder) / str(k)))

        def one(entry):
            copy = copies.get()
            try:
                return judged(entry, copy, limit)
            finally:
                copies.put(copy)

        with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
            yield from concurrent.futures.as_completed([pool.submit(one, entry) for entry in entries])


def known(entries, file) -> list[dict]:
    """Results in a file of these places as they stand; survivors and those out of time are tried again."""
    rows = json.loads(Path(file).read_text(encoding="utf-8")) if Path(file).exists() else []
    return [
        row for row in rows if row["result"] == "killed" and any(entry.items() <= row.items() for entry in entries)
    ]


def report(rows) -> str:
    """Counts by rule, and a line for every survivor."""
    counts = collections.Counter((row["rule"], row["result"]) for row in rows)
    lines = [f"{rule:<12} {result:<10} {number}" for (rule, result), number in sorted(counts.items())]
    for row in rows:
        if row["result"] == "survived":
            lines += ["", f"survived ({row['rule']}): jaxmbs/{row['file']}", f"  - {row['old']}", f"  + {row['new']}"]
            lines += [f"  run: {row['tests']}"]
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="places whose file, text or tests contain this")
    parser.add_argument("--jobs", type=int, default=1, help="copies worked on at once")
    parser.add_argument("--limit", type=float, default=1800.0, help="seconds for the tests of one place")
    parser.add_argument("--json", help="write the results to this file")
    parser.add_argument("--go-on", action="store_true", help="keep the results of the file of --json")
    options = parser.parse_args()
    entries = [
        entry for entry in mutants() if any(options.only in entry[k] for k in ("name", "new", "tests", "rule"))
    ]
    wrong = [fault for entry in entries for fault in faults(entry)]
    if wrong or not entries:
        print("\n".join(wrong) or f"no place contains {options.only!r}")
        return 2
    rows = known(entries, options.json) if options.go_on and options.json else []
    left = [entry for entry in entries if entry["name"] not in {row["name"] for row in rows}]
    for future in run(left, options.jobs, options.limit):
        rows.append(row := future.result())
        print(f"{len(rows):4d}/{len(entries)} {row['result']:<9}{row['seconds']:8.1f} s  {row['name']}", flush=True)
        if options.json:
            Path(options.json).write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    print(report(rows))
    return int(any(row["result"] == "survived" and row["rule"] in FATAL for row in rows))


if __name__ == "__main__":
    sys.exit(main())
