"""Types for users: every public function says what it takes and returns, and a type checker reads it."""

import importlib
import inspect
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tests.test_public_faces import FACES

ROOT = Path(__file__).parent.parent

RIGHT = """
from typing import assert_type

import jaxmbs as mbs

builder = mbs.SystemBuilder()
builder.body("arm", mass=1.0, com=[0.0, 0.0, -1.0])
builder.joint("pin", mbs.Revolute("y"), "ground", "arm", at=(0, 0, 0))
builder.force("spring", mbs.SpringDamper(stiffness=100.0, damping=2), joint="pin")
system = builder.build()
state = mbs.State.at(system, pin=0.3)
motion = mbs.simulate(system, state, t1=1.0, dt=0.01, solver=mbs.ode.Gauss4())
mbs.position(system, state, ("arm", (0.0, 0.0, 1.0)))
mbs.reactions(system, motion)["pin"]
assert_type(motion, mbs.Motion)
linear = mbs.LinearSystem(stiffness=[[1.0]], mass=[[1.0]])
assert_type(mbs.simulate(linear, t1=1.0), mbs.vibration.LinearMotion)
assert_type(mbs.modes(linear, num=1), mbs.vibration.Modes)
"""
WRONG = [
    "mbs.simulate(system, 3.0)",
    "mbs.simulate(system, state, t_end=1.0)",
    "mbs.simulate(linear, event='end')",
    "mbs.modes(linear, without=['a'])",
    "mbs.reactions(system, 3.0)",
    "mbs.position(system, state, 3)",
    "mbs.stiffness(state, system)",
    "mbs.inverse_dynamics(system, 3.0)",
    "mbs.dynamics.kinetic_energy(system, motion)",
    "builder.body('leg', mass='heavy')",
    "builder.joint('knee', 'revolute', 'arm', 'leg')",
    "builder.force('push', mbs.Revolute('x'), joint='pin')",
    "builder.build(like=state)",
]


def _functions(thing):
    """The functions of this library behind a public name: itself, or the methods of a class and of its bases."""
    if inspect.isclass(thing):
        for base in thing.__mro__:
            for name, member in vars(base).items() if base.__module__.startswith("jaxmbs.") else ():
                if name.startswith("_") and name not in ("__init__", "__call__"):
                    continue
                member = member.fget if isinstance(member, property) else getattr(member, "__func__", member)
                yield from _functions(member) if callable(member) and not inspect.isclass(member) else ()
    elif callable(thing):
        function = inspect.unwrap(thing)
        if inspect.isfunction(function) and function.__module__.startswith("jaxmbs."):
            if Path(function.__code__.co_filename).is_relative_to(ROOT):  # none that dataclasses wrote
                yield function


def _is_bare(function):
    names = list(inspect.signature(function).parameters)
    names = names[1:] if names[:1] in (["self"], ["cls"]) else names
    return not {*names, "return"} <= set(function.__annotations__)


def test_public_functions_are_annotated():
    things = [
        getattr(importlib.import_module(room), name)
        for room in set(FACES) - {"jaxmbs.runtime"}
        for name in FACES[room].split()
    ]
    found = {f for thing in things if not inspect.ismodule(thing) for f in _functions(thing)}
    assert len(found) > 400
    assert not {f"{f.__module__}.{f.__qualname__}" for f in found if _is_bare(f)}


def test_the_package_says_that_it_is_typed():
    assert (ROOT / "jaxmbs" / "py.typed").exists()


def test_no_module_is_exempt_from_the_type_checker():
    """`.ci/run` calls mypy for all of them."""
    mypy = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["mypy"]
    assert not [entry for entry in mypy.get("overrides", []) if entry.get("ignore_errors")]


def _mypy(*arguments):
    command = [sys.executable, "-m", "mypy", "--config-file", str(ROOT / "pyproject.toml"), *map(str, arguments)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=600)


@pytest.mark.long
def test_mypy_refuses_wrong_calls_and_takes_right_ones(tmp_path):
    file = tmp_path / "users_own.py"
    file.write_text(RIGHT + "\n".join(WRONG) + "\n")
    done = _mypy("--no-error-summary", file)
    first = len(RIGHT.splitlines()) + 1
    lines = {
        int(line.split(":")[1]) for line in done.stdout.splitlines() if "users_own.py" in line and ": error:" in line
    }
    assert lines == set(range(first, first + len(WRONG))), done.stdout + done.stderr
