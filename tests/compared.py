"""How near the numbers of tests are to those that they are held to, by file.

    COMPARED=compared python -m pytest -p tests.compared tests/cases -m ""
    python -m tests.compared compared                # a table of the files

Numbers compared by `numpy.testing.assert_allclose` are counted; those of a plain `assert` are not.
"""

import collections
import os
import sys
from pathlib import Path

import numpy as np
import pytest

_found: list[tuple[int, float]] = []
_assert_allclose = np.testing.assert_allclose


def _measured(actual, desired, rtol=1e-7, atol=0.0, **other):
    """The check, with the largest difference in parts of what it allows."""
    _assert_allclose(actual, desired, rtol, atol, **other)
    shaped = np.broadcast_arrays(*(np.asarray(x) * 1.0 for x in (actual, desired)))
    there = np.isfinite(shaped[0]) & np.isfinite(shaped[1])
    found, wanted = (x[there] for x in shaped)
    allowed = atol + rtol * np.abs(wanted)
    used = np.abs(found - wanted) / np.where(allowed > 0, allowed, 1.0)
    _found.append((found.size, float(np.max(used, initial=0.0))))


def pytest_configure():
    np.testing.assert_allclose = _measured


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item):
    _found.clear()
    yield
    if _found:
        numbers, used = zip(*_found, strict=True)
        with open(f"{os.environ['COMPARED']}.{os.environ.get('PYTEST_XDIST_WORKER', 'main')}", "a") as file:
            print(sum(numbers), max(used), item.nodeid, file=file)


def main(log: str) -> None:
    """Print a table of files."""
    files = collections.defaultdict(list)
    for path in Path(log).parent.glob(f"{Path(log).name}.*"):
        for line in path.read_text().splitlines():
            count, used, name = line.split(" ", 2)
            files[name.split("::")[0]].append((int(count), float(used)))
    print("| file | tests | numbers | largest part of the tolerance |\n|---|---|---|---|")
    for name, rows in sorted(files.items()):
        numbers, used = zip(*rows, strict=True)
        print(f"| `{name}` | {len(rows)} | {sum(numbers)} | {max(used):.2g} |")


if __name__ == "__main__":
    main(sys.argv[1])
