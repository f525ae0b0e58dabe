"""CPU seconds of every test, by folder, and those of quick and slow tests that are to be long ones.

    CPU_LOG=cpu python -m pytest -p tests.cpu_seconds              # writes cpu.gw0, cpu.gw1
    python -m tests.cpu_seconds cpu                                # number and seconds of each folder
    python -m tests.cpu_seconds cpu 1.5                            # tests of more than 1.5 s

CPU seconds, unlike those of a clock, do not depend on what else the machine does.
"""

import collections
import os
import sys
import time
from pathlib import Path

import pytest

_file = None


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item):
    global _file
    if _file is None:
        _file = open(f"{os.environ['CPU_LOG']}.{os.environ.get('PYTEST_XDIST_WORKER', 'main')}", "a")
    start = time.process_time()
    yield
    print(f"{time.process_time() - start:.3f} {item.nodeid}", file=_file, flush=True)


def _seconds(log: str) -> dict[str, float]:
    """Seconds of each test in the files of a log."""
    lines = [line for path in Path(log).parent.glob(f"{Path(log).name}.*") for line in path.read_text().splitlines()]
    return {name: float(seconds) for seconds, name in (line.split(" ", 1) for line in lines)}


def main(log: str, most: float | None = None) -> None:
    """Print a table of folders, or the tests that took more than `most` CPU seconds."""
    if most is not None:
        print("\n".join(f"{s:8.1f} {name}" for name, s in sorted(_seconds(log).items()) if s > most))
        return
    folders: dict[str, list[float]] = collections.defaultdict(list)
    for name, seconds in _seconds(log).items():
        folders[Path(name.split("::")[0]).parts[1].removesuffix(".py")].append(seconds)
    for folder, seconds in sorted(folders.items()):
        print(f"| {folder} | {len(seconds)} | {sum(seconds):.0f} |")


if __name__ == "__main__":
    main(sys.argv[1], *map(float, sys.argv[2:]))
