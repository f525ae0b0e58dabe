"""Double precision switched on, or off, in the middle of a process: what was compiled before does no harm."""

import json
import subprocess
import sys
from pathlib import Path

import jax
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.runtime import _precision as precision

ROOT = Path(__file__).parents[2]

_ASK = """
import json, sys, warnings
import jax, jax.numpy as jnp, numpy as np
import jaxmbs as mbs
warnings.simplefilter("ignore")

def four_bar():
    b, pin = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0)), mbs.Revolute("z")
    for name, length in (("crank", 0.3), ("coupler", 0.9), ("rocker", 0.7)):
        b.body(name, mass=length, com=(length / 2, 0.0, 0.0), inertia=mbs.inertia.rod(length, length))
    b.joint("A", pin, "ground", "crank")
    b.joint("B", pin, "crank", "coupler", parent_frame=(0.3, 0.0, 0.0))
    b.joint("D", pin, "ground", "rocker", parent_frame=(1.0, 0.0, 0.0))
    b.joint("C", pin, "coupler", "rocker", parent_frame=(0.9, 0.0, 0.0), child_frame=(0.7, 0.0, 0.0))
    b.force("spring", mbs.SpringDamper(40.0, 1.0, 0.3), joint="A")
    b.force("strut", mbs.Table([0.1, 0.9], [-4.0, 8.0]), between=(("ground", (0.0, 0.5, 0.0)), "coupler"))
    return b.build(independent=["A"])

def pendulum():
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    b.body("bob", mass=1.0, com=(0.0, -1.0, 0.0), inertia=0.01)
    b.joint("pin", mbs.Revolute("z"), "ground", "bob")
    return b.build()

def answers():
    bar, rod = four_bar(), pendulum()
    state = mbs.State.at(bar, A=0.7, velocities={"A": 1.0}, guess={"B": -0.4, "D": 1.5})
    start = mbs.State.at(rod, pin=1.0)
    close = 1e-9 if jax.config.jax_enable_x64 else 1e-5
    motion = mbs.simulate(rod, start, t1=0.4, rtol=close, atol=close)
    found = {
        "State.at": state.coordinates,
        "simulate": motion.states.coordinates[-1],
        "reactions": mbs.reactions(rod, motion)["pin"].force[-1],
        "reactions of a loop": mbs.reactions(bar, state)["D"].force,
        "linearise": mbs.linearise(rod, start).stiffness,
        "stiffness": mbs.stiffness(bar, state).total,
        "potential_energy": mbs.dynamics.potential_energy(bar, state),
    }
    width = {name: np.asarray(value).dtype.itemsize for name, value in found.items()}
    return {name: np.asarray(value, float).tolist() for name, value in found.items()}, width

said = []
for wide in json.loads(sys.argv[1]):
    jax.config.update("jax_enable_x64", wide)
    said.append(answers())
print(json.dumps(said))
"""


@pytest.mark.long
def test_programs_are_forgotten_when_the_setting_changed(monkeypatch):
    """Once for each change, and not in the middle of a trace."""
    cleared = []
    monkeypatch.setattr(jax, "clear_caches", lambda: cleared.append(True))
    monkeypatch.setattr(precision, "_seen", {False})

    @jax.jit
    def traced(x):
        precision.follow_precision()
        return x

    traced(1.0)
    assert not cleared
    precision.follow_precision()
    precision.follow_precision()
    assert len(cleared) == 1 and precision._seen == {True}


@pytest.fixture(scope="module")
def asked():
    """Answers and their widths in bytes, by order of the settings and by setting, each order in one process."""
    found = {}
    for order in ([False, True], [True, False]):
        command = [sys.executable, "-c", _ASK, json.dumps(order)]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr[-4000:]
        found[tuple(order)] = dict(zip(order, json.loads(done.stdout.splitlines()[-1]), strict=True))
    return found


@pytest.mark.long
def test_answers_have_the_precision_of_the_setting(asked):
    for order in asked.values():
        for double, (_, width) in order.items():
            assert set(width.values()) == {8 if double else 4}, width


@pytest.mark.long
@pytest.mark.parametrize("double, close", [(True, 1e-10), (False, 1e-4)])
def test_answers_do_not_depend_on_what_came_before(asked, double, close):
    """Double precision after single has all its digits, and the other way round."""
    fresh, later = asked[double, not double][double][0], asked[not double, double][double][0]
    for name, value in fresh.items():
        np.testing.assert_allclose(later[name], value, rtol=close, atol=close, err_msg=name)


def test_a_model_of_double_precision_says_that_jax_was_switched():
    b = mbs.SystemBuilder()
    b.body("bob", mass=1.0, com=(0.0, -1.0, 0.0), inertia=0.01)
    b.joint("pin", mbs.Revolute("z"), "ground", "bob")
    system = b.build()
    state = mbs.State.at(system, pin=0.3)
    springs = mbs.LinearSystem(mass=np.eye(2), stiffness=np.eye(2))
    asked = {
        "state": lambda: mbs.State.at(system, pin=0.3),
        "motion": lambda: mbs.simulate(system, state, t1=1.0),
        "place": lambda: mbs.position(system, state, "bob"),
        "loads": lambda: mbs.reactions(system, state),
        "rest": lambda: mbs.equilibrium(system, state),
        "modes": lambda: mbs.modes(springs),
    }
    with jax.enable_x64(False):
        for name, ask in asked.items():
            with pytest.raises(mbs.ModelError, match="switched to single"):
                ask()
                pytest.fail(name)
    assert asked["modes"]().values.dtype == np.float64
