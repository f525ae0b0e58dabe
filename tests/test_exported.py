"""Questions stored in files: the same answers and slopes in another process, for other numbers of the model."""

import json
import subprocess
import sys
import zipfile

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs

MODEL = """
import jax, jax.numpy as jnp
jax.config.update("jax_enable_x64", True)
import jaxmbs as mbs

def pendulum(mass, name="bob"):
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    b.body(name, mass=mass, com=(0.0, -0.8, 0.0))
    b.joint("pin", mbs.Revolute("z"), "ground", name)
    return b.build()

def loads(system, state):
    return mbs.reactions(system, mbs.simulate(system, state, t1=0.3, throw=False))
"""
ASKED = """
import collections, sys
count = collections.Counter()
jax.monitoring.register_event_duration_secs_listener(lambda event, *_, fun_name="", **__: count.update([fun_name]))
program = mbs.load_program(sys.argv[1])
system = pendulum(3.0)
state = mbs.State.at(system, pin=0.7)
slope = jax.grad(lambda s: jnp.sum(program(s, state)["pin"].force ** 2))(system)
print(float(jnp.sum(program(system, state)["pin"].force ** 2)), float(slope.mass[0]))
print(sum("_integrate" in name or "_reactions" in name for name in count))
"""
exec(MODEL)


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    system = pendulum(2.0)  # noqa: F821
    example = system, mbs.State.at(system, pin=1.0)
    return mbs.export(loads, example, tmp_path_factory.mktemp("stored") / "loads.mbs")  # noqa: F821


@pytest.mark.long
def test_another_process_asks_it_with_another_mass_and_traces_no_model(stored):
    system = pendulum(3.0)  # noqa: F821
    state = mbs.State.at(system, pin=0.7)
    total = lambda s: jnp.sum(loads(s, state)["pin"].force ** 2)  # noqa: E731, F821
    found = subprocess.run(
        [sys.executable, "-c", MODEL + ASKED, str(stored)], capture_output=True, text=True, check=True
    ).stdout.split()
    np.testing.assert_allclose(float(found[0]), total(system), rtol=1e-9)
    np.testing.assert_allclose(float(found[1]), jax.grad(total)(system).mass[0], rtol=1e-7)
    assert found[2] == "0"


@pytest.mark.slow
def test_it_runs_inside_of_a_jit_and_names_its_results(stored):
    program, system = mbs.load_program(stored), pendulum(2.5)  # noqa: F821
    state = mbs.State.at(system, pin=1.0)
    found, wanted = jax.jit(program)(system, state), loads(system, state)  # noqa: F821
    assert list(found) == ["pin"] and type(found) is type(wanted)
    np.testing.assert_allclose(found["pin"].force, wanted["pin"].force, rtol=1e-9, atol=1e-9)


@pytest.mark.slow
def test_another_structure_is_refused(stored):
    program, system = mbs.load_program(stored), pendulum(2.0, name="weight")  # noqa: F821
    with pytest.raises(ValueError, match="not of the structure that 'loads' was exported with"):
        program(system, mbs.State.at(system, pin=1.0))
    with pytest.raises(ValueError, match=r"it takes float64\[3\]"):
        program(1.0)


@pytest.mark.slow
def test_files_that_do_not_fit(stored, tmp_path):
    with pytest.raises(OSError, match="nowhere"):
        mbs.load_program(tmp_path / "nowhere")
    (tmp_path / "text").write_text("no program")
    with pytest.raises(ValueError, match="no program that `export` stored"):
        mbs.load_program(tmp_path / "text")
    for field, value, said in (("jax", "0.1.2", "stored with jax 0.1.2"), ("platforms", ["tpu"], "stored for tpu")):
        with zipfile.ZipFile(stored) as old, zipfile.ZipFile(tmp_path / field, "w") as new:
            for name in old.namelist():
                content = old.read(name)
                if name == "about.json":
                    content = json.dumps({**json.loads(content), field: value})
                new.writestr(name, content)
        with pytest.raises(ValueError, match=said):
            mbs.load_program(tmp_path / field)


def test_examples_that_are_no_numbers():
    with pytest.raises(TypeError, match="example must be the tuple of arguments, got float"):
        mbs.export(jnp.sin, 1.0, "unused")
    with pytest.raises(TypeError, match="argument\\[0\\]\\['law'\\] is no number"):
        mbs.export(lambda d: d["x"], ({"law": "linear", "x": 1.0},), "unused")
