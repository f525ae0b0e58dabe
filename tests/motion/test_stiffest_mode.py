"""A motion that crawls says what takes so long and which solver is for it, and never what was done already."""

import sys

import diffrax
import pytest

import jaxmbs as mbs
from jaxmbs.runtime import tuning


@pytest.fixture(scope="module")
def strut():
    """A gram on a stiff strut at the end of an arm."""
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    b.body("arm", mass=1.0, com=(0.5, 0, 0), inertia=0.1)
    b.body("tip", mass=1e-3, inertia=1e-7)
    b.joint("pin", mbs.Revolute("y"), "ground", "arm")
    b.joint("end", mbs.Prismatic("x"), "arm", "tip", parent_frame=(1.0, 0, 0))
    b.force("strut", mbs.SpringDamper(1e9, 1e3, free_length=1.0), between=("arm", "tip"))
    system = b.build()
    return system, mbs.State.at(system)


@pytest.fixture
def soon(monkeypatch):
    for name, value in {"SECONDS_TO_BAR": 0.05, "SECONDS_TO_ADVICE": 0.1, "SLOW_SECONDS": 1.0}.items():
        monkeypatch.setattr(tuning, name, value)


def test_it_says_what_takes_so_long(strut, soon, capfd):
    with pytest.raises(mbs.SimulationError):
        mbs.simulate(*strut, t1=1e3, max_steps=4_000, solver=diffrax.Dopri8())
    said = capfd.readouterr().err
    assert said.count("jaxmbs: simulate: ") == 1 and "%|" not in said  # no bar where nobody looks on
    for word in ("force 'strut'", "of end", "a rate of 1e+06 1/s", "solver=mbs.ode.Rodas5P()"):
        assert word in said


def test_in_a_terminal_there_is_a_bar(strut, soon, capfd, monkeypatch):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    with pytest.raises(mbs.SimulationError):
        mbs.simulate(*strut, t1=1e3, max_steps=4_000, solver=diffrax.Dopri8())
    said = capfd.readouterr().err
    assert "simulate:   0%|" in said and "force 'strut'" in said


def test_a_motion_that_ends_soon_says_nothing(strut, capfd):
    mbs.simulate(*strut, t1=1e-3)
    mbs.simulate(*strut, t1=1e-3, progress=False)
    assert capfd.readouterr().err == ""


def test_an_implicit_solver_is_not_advised_again(strut):
    with pytest.raises(mbs.SimulationError) as failed:
        mbs.simulate(*strut, t1=1e3, solver=mbs.ode.Rodas5P(), max_steps=5)
    assert "which Rodas5P steps over" in str(failed.value) and "take a stiff solver" not in str(failed.value)


def test_none_is_a_switch_of_its_own(strut):
    with pytest.raises(mbs.ModelError, match="progress must be True or False"):
        mbs.simulate(*strut, t1=1e-3, progress="no")
