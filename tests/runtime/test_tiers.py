"""Tiers: a tape at once, the compiler's program once the tape has cost as much, and processes that end meanwhile."""

import os
import subprocess
import sys
import threading

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.runtime import _jit as compiling
from jaxmbs.runtime import _tiers
from jaxmbs.runtime import _tuning as tuning
from jaxmbs.runtime._jit import jit
from jaxmbs.runtime._tape_program import TapeProgram
from jaxmbs.runtime._tiers import kept_tiers
from jaxmbs.runtime.tape import is_available

pytestmark = [
    pytest.mark.usefixtures("tricks_on"),
    pytest.mark.skipif(not is_available(), reason="the machine was not built"),
]
X = np.linspace(0.1, 2.0, 7)


def slope(x):
    return jax.grad(lambda x: jnp.sum(jnp.sin(x) ** 3 * jnp.exp(-x)))(x)


@pytest.fixture
def compiled(monkeypatch):
    """Kinds that the compiler is asked for, where a compilation costs nothing and the environment fixes no tier."""
    asked, before = [], compiling.compiler_options
    monkeypatch.setattr(tuning, "COMPILE_START", 0.0)
    monkeypatch.setattr(tuning, "COMPILE_SECONDS", 0.0)
    monkeypatch.setattr(compiling, "FIXED", "auto")
    monkeypatch.setattr(_tiers, "FIXED", "auto")

    def options(kind, backend, *often, **named):
        if threading.current_thread() is not threading.main_thread():
            asked.append(kind)
        return before(kind, backend, *often, **named)

    monkeypatch.setattr(compiling, "compiler_options", options)
    return asked


def wait():
    """Until nothing is compiled beside."""
    for thread in threading.enumerate():
        if thread.name == "jaxmbs compiler":
            thread.join()


@pytest.mark.parametrize("kind, then", [("auto", "full"), ("tape", None), ("quick", None)])
def test_the_compiler_takes_over_where_it_may(kind, then, compiled):
    function = jit(slope, compile=kind)
    first = [function(X) for _ in range(2)]
    wait()
    assert set(compiled) == ({then} if then else set())
    np.testing.assert_array_equal(*first)
    np.testing.assert_allclose(function(X), first[0], rtol=1e-14)


def test_a_search_keeps_its_tier(compiled, monkeypatch):
    """The first runs on its tape, the second too, and compiles beside; the third runs what is compiled."""
    runs, run, found = [], TapeProgram.run, []
    monkeypatch.setattr(TapeProgram, "run", lambda program, *arrays: [runs.append(1), run(program, *arrays)][1])
    function = jit(lambda x: 1.25 * slope(x))  # of its own: programs are known by their content
    for _ in range(3):
        runs.clear()
        with kept_tiers():
            values = [function(X), wait(), function(X)][::2]
        wait()
        np.testing.assert_array_equal(*values)
        found.append((len(compiled) > 0, len(runs)))
    assert found == [(False, 2), (True, 2), (True, 0)]


def test_a_tape_goes_on_where_compiling_fails(compiled):
    calls = []

    def fails_beside(x):
        calls.append(threading.current_thread() is threading.main_thread())
        assert calls[-1], "traced in another thread"
        return 2.0 * x

    function = jit(fails_beside)
    for _ in range(3):
        np.testing.assert_array_equal(function(X), 2.0 * X)
        wait()
    assert calls == [True, False]


def test_a_program_of_a_few_runs_is_not_compiled(compiled, monkeypatch):
    monkeypatch.setattr(tuning, "COMPILE_SECONDS", 1.0)
    jit(slope)(X)
    wait()
    assert not compiled


PROGRAM = """
import jax, numpy as np
jax.config.update("jax_enable_x64", True)
import jax.numpy as jnp
from jaxmbs.runtime import _tuning
_tuning.COMPILE_START = _tuning.COMPILE_SECONDS = 0.0
from jaxmbs.runtime._jit import jit
from jaxmbs.runtime._tape_program import TapeProgram
from jaxmbs.runtime._tiers import kept_tiers
heard = []
jax.monitoring.register_event_duration_secs_listener(lambda event, *_, **__: heard.append(event))
function = jit(lambda x: jnp.linalg.inv(x @ x.T + jnp.eye(8)) @ jnp.sin(x))
print(np.asarray(function(np.ones((8, 8)))).sum(), sum("backend_compile" in event for event in heard))
"""


def _run(setting, program=PROGRAM):
    environment = {**os.environ, "JAXMBS_COMPILE": setting}
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=environment)


@pytest.mark.slow
@pytest.mark.parametrize("setting", ["auto", "tape", "full"])
def test_a_process_ends_in_order_while_it_compiles(setting):
    done = _run(setting)
    assert done.returncode == 0, done.stderr
    value, programs = done.stdout.split()
    assert np.isclose(float(value), 8 * 8 * np.sin(1.0) / (8 * 8 + 1.0)) and (int(programs) > 0 or setting != "full")


@pytest.mark.long
def test_twenty_processes_end_in_order():
    program = PROGRAM + "import sys, time; time.sleep({}); sys.exit(0)"
    done = [_run("auto", program.format(0.02 * k)) for k in range(20)]
    assert [each.returncode for each in done] == [0] * 20


def test_unknown_tiers_are_refused():
    done = _run("fast", "import jaxmbs")
    assert done.returncode and "JAXMBS_COMPILE='fast' must be auto, tape or full" in done.stderr


def test_a_call_that_names_a_tier_is_not_overruled_by_the_environment():
    rows = """
import jaxmbs
for kind in ("tape", "auto"):
    heard.clear()
    jaxmbs.batch(lambda x: jnp.sin(x) ** 2, np.arange(3.0), compile=kind, progress=False)
    print(sum("backend_compile" in event for event in heard))
"""
    done = _run("full", PROGRAM.replace("jit(lambda", "jit(compile='tape')(lambda") + rows)
    _, of_jit, of_batch, of_auto = done.stdout.split()
    assert of_jit == of_batch == "0" and int(of_auto) > 0, done.stderr
