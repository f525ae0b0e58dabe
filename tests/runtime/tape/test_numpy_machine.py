"""The machine in NumPy computes what the one in C does, and gives up what compiling can do sooner."""

import os
import subprocess
import sys
from pathlib import Path

import jax
import numpy as np
import pytest
from jax import lax

from jaxmbs.runtime import _tuning as tuning
from jaxmbs.runtime.tape import OvertimeError, Tape, machine_kind, time_limit
from jaxmbs.runtime.tape import _machine as machines
from jaxmbs.runtime.tape._numpy_elementwise import _FUNCTIONS, _UFUNCS, _WHOLE
from jaxmbs.runtime.tape._numpy_machine import _CONTROL
from jaxmbs.runtime.tape._numpy_memory import BINDINGS
from jaxmbs.runtime.tape._opcodes import CODE

from .programs import PROGRAMS
from .test_tape import tape_of

#: Operations whose results IEEE arithmetic fixes to the last bit.
EXACT = "rough comparisons gathers scatters conversions shapes".split() + ["whole numbers", "slices at places"]


@pytest.fixture
def in_numpy(monkeypatch):
    monkeypatch.setattr(machines, "ASKED", "numpy")


def test_each_operation_has_its_binding():
    assert CODE.keys() == {*BINDINGS, *_CONTROL, "HOST"} and BINDINGS.keys() >= {*_UFUNCS, *_FUNCTIONS, *_WHOLE}


@pytest.mark.skipif(machine_kind() != "c", reason="this installation was made without a C compiler")
@pytest.mark.parametrize("name", PROGRAMS)
def test_a_program_is_that_of_the_machine_in_c(name, monkeypatch):
    args, parts = PROGRAMS[name][1], tape_of(name).parts
    want = Tape(parts)(*args)
    monkeypatch.setattr(machines, "ASKED", "numpy")
    tape = Tape(parts)
    tape(*(np.ones_like(arg) for arg in args))
    for a, b in zip(tape(*args), want, strict=True):
        tolerance = 0.0 if name in EXACT else 1e-14
        largest = np.max(np.abs(b), initial=0.0, where=np.isfinite(b))
        np.testing.assert_allclose(a, b, rtol=tolerance, atol=tolerance * largest)


def test_what_takes_longer_than_compiling_is_given_up(in_numpy, monkeypatch):
    monkeypatch.setattr(tuning, "COMPILE_START", 0.0)
    monkeypatch.setattr(tuning, "COMPILE_SECONDS", 0.0)
    tape = Tape(jax.make_jaxpr(lambda x: lax.fori_loop(0, 500, lambda k, x: x * 0.5 + 1.0, x))(np.ones(3)))
    np.testing.assert_allclose(tape(np.ones(3))[0], 2.0)
    for _ in range(2):
        with time_limit(True), pytest.raises(OvertimeError):
            tape(np.ones(3))
    with time_limit(False):
        np.testing.assert_allclose(tape(np.ones(3))[0], 2.0)


@pytest.mark.long
@pytest.mark.parametrize("setting", ["numpy", "auto"])
def test_the_tests_of_tapes_pass_on_it(setting):
    """By the environment, and where no machine was built."""
    folder = Path(__file__).parent
    without = "import jaxmbs.runtime.tape._build as b; b.LIBRARY = b.LIBRARY.with_name('none.so'); "
    program = f"{without if setting == 'auto' else ''}import sys, pytest; sys.exit(pytest.main(sys.argv[1:]))"
    tests = [str(folder / "test_tape.py"), str(folder.parent / "test_tiers.py"), "-n", "0", "-q"]
    environment = {**os.environ, "JAXMBS_TAPE": setting, "JAXMBS_COMPILE": "tape"}
    done = subprocess.run([sys.executable, "-c", program, *tests], capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stdout[-3000:]


def test_other_machines_are_refused():
    with pytest.raises(ValueError, match="JAXMBS_TAPE='fortran' must be auto, c or numpy"):
        machines._machine_setting("fortran")
