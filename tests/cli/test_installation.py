"""The command line: doctor, version, wrong commands."""

import subprocess
import sys

import pytest

import jaxmbs
from jaxmbs.cli import main


@pytest.mark.slow
def test_doctor(capsys):
    assert main(["doctor"]) == 0
    assert "devices" in capsys.readouterr().out


def test_version(capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["--version"])
    assert stopped.value.code == 0
    assert capsys.readouterr().out.split() == ["jaxmbs", jaxmbs.__version__]


@pytest.mark.parametrize("arguments", [["dance"], [], ["demo", "--loud"]])
def test_wrong_command_is_refused_with_usage(arguments, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(arguments)
    assert stopped.value.code == 2
    assert "usage: python -m jaxmbs" in capsys.readouterr().err


@pytest.mark.long
def test_module_runs():
    done = subprocess.run([sys.executable, "-m", "jaxmbs", "--help"], capture_output=True, text=True)
    assert done.returncode == 0 and "demo" in done.stdout and "doctor" in done.stdout
