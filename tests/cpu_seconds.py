"""CPU seconds of every test, and the list of those too dear for each change, `tests/dear_tests.txt`.

    CPU_LOG=cpu python -m pytest -p tests.cpu_seconds              # writes cpu.gw0, cpu.gw1
    CPU_LOG=cpu python -m pytest -m slow -p tests.cpu_seconds
    python -m tests.cpu_seconds cpu 1.5                            # adds to the list what took more than 1.5 s

CPU seconds, unlike those of a clock, do not depend on what else the machine does.
"""

import os
import sys
import time
from pathlib import Path

import pytest

DEAR = Path(__file__).parent / "dear_tests.txt"
#: Rules that every change is held to, whatever they cost; and published numbers, which may cost twice as much.
KEPT = ("tests/test_program_size.py", "tests/test_manual.py::test_page_runs[start/first", "tests/test_words.py")
KEPT += ("tests/test_typing.py", "tests/test_wheel.py")
PUBLISHED = "tests/cases/"
_file = None


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item):
    global _file
    if _file is None:
        _file = open(f"{os.environ['CPU_LOG']}.{os.environ.get('PYTEST_XDIST_WORKER', 'main')}", "a")
    start = time.process_time()
    yield
    print(f"{time.process_time() - start:.3f} {item.nodeid}", file=_file, flush=True)


def dear_tests() -> set[str]:
    """Names of the tests in the list."""
    lines = DEAR.read_text(encoding="utf-8").splitlines()
    return {line for line in lines if line and not line.startswith("#")}


def main(log: str, most: float) -> None:
    """Add to the list the tests of the logs that took more than `most` CPU seconds."""
    found = set()
    for path in Path(log).parent.glob(f"{Path(log).name}.*"):
        for line in path.read_text().splitlines():
            seconds, name = line.split(" ", 1)
            bound = 2 * most if name.startswith(PUBLISHED) else most
            found |= {name} if float(seconds) > bound and not name.startswith(KEPT) else set()
    head = [line for line in DEAR.read_text(encoding="utf-8").splitlines() if line.startswith("#")]
    DEAR.write_text("\n".join([*head, *sorted(dear_tests() | found)]) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
