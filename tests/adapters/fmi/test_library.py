"""The shared library: its compiler, and a host in C that is no Python."""

import os
import shutil
import subprocess
import sys
import zipfile

import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.adapters.fmi import _library, export_fmu

from .mechanisms import needs_compiler, pendulum


def test_a_missing_compiler_is_named(monkeypatch):
    monkeypatch.setenv("CC", "no_such_compiler -O1")
    with pytest.raises(mbs.ModelError, match="needs a C compiler, and there is no no_such_compiler"):
        _library.compiler()


def test_other_platforms_are_refused(monkeypatch):
    monkeypatch.setattr(sys, "platform", "win32")
    with pytest.raises(mbs.ModelError, match="made on Linux alone, this is win32"):
        _library.platform_name()


def test_sizes_and_texts_are_defined():
    text = _library.sizes_header({"NUM_X": 2}, 'a "token"')
    assert "#define NUM_X 2\n" in text and '#define TOKEN "a \\"token\\""\n' in text


@pytest.mark.long
def test_the_words_of_a_compiler_that_fails_are_told():
    needs_compiler()
    with pytest.raises(mbs.ModelError, match="NUM_X"):
        _library.compile_library("")


@pytest.mark.long
def test_a_host_in_c_loads_python(tmp_path):
    fmpy = needs_compiler()
    if not _library.python_library():
        pytest.skip("this Python has no shared library")
    system, state = pendulum()
    path = export_fmu(system, ["motor"], ["height"], tmp_path / "one.fmu", state=state)
    with zipfile.ZipFile(path) as file:
        file.extractall(tmp_path / "one")
    description = fmpy.read_model_description(str(path))
    output = next(x.valueReference for x in description.modelVariables if x.name == "height")
    source = os.path.join(os.path.dirname(__file__), "host.c")
    compiler = next(name for name in ("cc", "gcc", "clang") if shutil.which(name))
    subprocess.run([compiler, "-O1", "-o", tmp_path / "host", source, "-ldl"], check=True)
    library = tmp_path / "one" / "binaries" / _library.platform_name() / "one.so"
    arguments = [library, description.instantiationToken, tmp_path / "one" / "resources", str(output), "0.5", "1.0"]
    command = [str(x) for x in (tmp_path / "host", *arguments)]
    clean = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL"))}
    done = subprocess.run(command, capture_output=True, text=True, env=clean)
    assert done.returncode == 0, done.stderr
    found = np.array(done.stdout.split(), float)
    there = mbs.State.at(system, pin=0.5, velocities={"pin": 1.0})
    np.testing.assert_allclose(found[:2], [1.0, mbs.forward_dynamics(system, there)[0][0]], rtol=1e-12)
    np.testing.assert_allclose(found[2], -0.5 * np.sin(0.5), rtol=1e-12)
    broken = subprocess.run(
        command, capture_output=True, text=True, env=clean | {"JAXMBS_FMU_LIBPYTHON": "/nowhere/libpython.so"}
    )
    assert broken.returncode == 2 and "name it in the environment variable JAXMBS_FMU_LIBPYTHON" in broken.stderr
    wrong = subprocess.run([*command[:2], "{token}", *command[3:]], capture_output=True, text=True, env=clean)
    assert wrong.returncode == 2 and "token" in wrong.stderr
