"""Batched programs come to an end, call after call, with the threads a user's process has."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROGRAMS = ["motion", "driven", "equilibrium", "modes"]


def _environment():
    """The user's: without what the test run sets for itself; compiled."""
    kept = {name: value for name, value in os.environ.items() if name not in ("XLA_FLAGS", "PJRT_NPROC")}
    return kept | {"JAXMBS_COMPILE": "full"}


def _marked(name):
    return pytest.param(name, marks=pytest.mark.long if name != "modes" else pytest.mark.slow)


def _watch(name, lanes, calls):
    command = [sys.executable, "-m", "tests.runtime.watchdog", name, str(lanes), str(calls)]
    done = subprocess.run(command, cwd=ROOT, env=_environment(), capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("name", [_marked(name) for name in ("motion", "driven", "modes")])
def test_no_hang(name):
    _watch(name, 64, 12)


#: Ends by itself where the tests are killed.
BUSY = "import os; parent = os.getppid()\nwhile os.getppid() == parent: pass"


@pytest.mark.long
@pytest.mark.parametrize("name", PROGRAMS)
def test_no_hang_beside_a_busy_process(name):
    busy = subprocess.Popen([sys.executable, "-c", BUSY])
    try:
        _watch(name, 256, 60)
    finally:
        busy.kill()
        busy.wait()
