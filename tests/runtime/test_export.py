"""Questions stored in files: the same answers and slopes in another process, for other numbers of the model."""

import json
import subprocess
import sys
import zipfile

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.model._internal_states import InternalRecord
from jaxmbs.runtime._structure_data import from_data, to_data

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
program = mbs.runtime.load_program(sys.argv[1])
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
    return mbs.runtime.export(loads, example, tmp_path_factory.mktemp("stored") / "loads.mbs")  # noqa: F821


@pytest.mark.long
def test_another_process_asks_it_with_another_mass_and_traces_no_model(stored):
    system = pendulum(3.0)  # noqa: F821
    state = mbs.State.at(system, pin=0.7)
    total = lambda s: jnp.sum(loads(s, state)["pin"].force ** 2)  # noqa: F821
    found = subprocess.run(
        [sys.executable, "-c", MODEL + ASKED, str(stored)], capture_output=True, text=True, check=True
    ).stdout.split()
    np.testing.assert_allclose(float(found[0]), total(system), rtol=1e-9)
    np.testing.assert_allclose(float(found[1]), jax.grad(total)(system).mass[0], rtol=1e-7)
    assert found[2] == "0"


@pytest.mark.long
def test_it_runs_inside_of_a_jit_and_names_its_results(stored):
    program, system = mbs.runtime.load_program(stored), pendulum(2.5)  # noqa: F821
    state = mbs.State.at(system, pin=1.0)
    found, wanted = jax.jit(program)(system, state), loads(system, state)  # noqa: F821
    assert list(found) == ["pin"] and type(found) is type(wanted)
    np.testing.assert_allclose(found["pin"].force, wanted["pin"].force, rtol=1e-9, atol=1e-9)


@pytest.mark.long
def test_another_structure_is_refused(stored):
    program, system = mbs.runtime.load_program(stored), pendulum(2.0, name="weight")  # noqa: F821
    with pytest.raises(ValueError, match="not of the structure that 'loads' was exported with"):
        program(system, mbs.State.at(system, pin=1.0))
    with pytest.raises(ValueError, match=r"it takes float64\[3\]"):
        program(1.0)


@pytest.mark.long
def test_files_that_do_not_fit(stored, tmp_path):
    with pytest.raises(OSError, match="nowhere"):
        mbs.runtime.load_program(tmp_path / "nowhere")
    (tmp_path / "text").write_text("no program")
    with pytest.raises(ValueError, match="no program that `export` stored"):
        mbs.runtime.load_program(tmp_path / "text")
    for field, value, said in (("jax", "0.1.2", "stored with jax 0.1.2"), ("platforms", ["tpu"], "stored for tpu")):
        with zipfile.ZipFile(stored) as old, zipfile.ZipFile(tmp_path / field, "w") as new:
            for name in old.namelist():
                content = old.read(name)
                if name == "about.json":
                    content = json.dumps({**json.loads(content), field: value})
                new.writestr(name, content)
        with pytest.raises(ValueError, match=said):
            mbs.runtime.load_program(tmp_path / field)


def test_examples_that_are_no_numbers():
    with pytest.raises(TypeError, match="example must be the tuple of arguments, got float"):
        mbs.runtime.export(jnp.sin, 1.0, "unused")
    with pytest.raises(TypeError, match="argument\\[0\\]\\['law'\\] is no number"):
        mbs.runtime.export(lambda d: d["x"], ({"law": "linear", "x": 1.0},), "unused")


def hung(law):
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    b.body("bob", mass=1.0, com=(0.0, -1.0, 0.0))
    b.joint("pin", mbs.Revolute("z"), "ground", "bob")
    b.force("spring", mbs.Actuator(law), joint="pin")
    return b.build()


def pulling(k):
    def law(x, v, t):
        return -k * x

    return law


def reading(factor):
    """A law that reads a global number."""
    space = {"FACTOR": factor, "__name__": __name__}
    exec("def law(x, v, t): return -FACTOR * x", space)
    return space["law"]


@pytest.mark.long
@pytest.mark.parametrize("make", [pulling, reading, lambda k: lambda x, v, t, k=k: -k * x])
def test_laws_of_one_name_are_told_apart(make, tmp_path):
    """By the numbers that they close over, read or have as a default; the same law defined again is the same."""
    system = hung(make(2.0))
    state = mbs.State.at(system, pin=0.7)
    spring = lambda s, x: mbs.reactions(s, x)["pin"].effort
    mbs.runtime.export(spring, (system, state), tmp_path / "spring")
    program = mbs.runtime.load_program(tmp_path / "spring")
    again = hung(make(2.0))
    assert jax.tree.structure(again) == jax.tree.structure(system)
    np.testing.assert_allclose(program(again, state), spring(system, state))
    with pytest.raises(ValueError, match="laws"):
        program(hung(make(5.0)), state)


def test_a_failing_export_keeps_the_good_file(tmp_path):
    path = mbs.runtime.export(jnp.sin, (jnp.zeros(2),), tmp_path / "sine")
    with pytest.raises(TypeError, match="cannot be stored as data"):
        mbs.runtime.export(lambda x: jax.tree_util.Partial(lambda y: y, x), (jnp.zeros(2),), path)
    with pytest.raises(ZeroDivisionError):
        mbs.runtime.export(lambda x: x * (1 // 0), (jnp.zeros(2),), path)
    np.testing.assert_allclose(mbs.runtime.load_program(path)(jnp.ones(2)), np.sin(np.ones(2)))
    assert [entry.name for entry in tmp_path.iterdir()] == ["sine"]


def test_damaged_files_are_refused_in_words(tmp_path):
    """Cut and flipped at many places: a ValueError that names the file, or the right answer."""
    path = mbs.runtime.export(jnp.sin, (jnp.zeros(2),), tmp_path / "sine")
    good, chance = path.read_bytes(), np.random.default_rng(0)
    for trial in range(60):
        bad = bytearray(good)
        if trial % 2:
            bad = bad[: chance.integers(len(good))]
        else:
            bad[chance.integers(len(good))] ^= 1 << int(chance.integers(8))
        path.write_bytes(bytes(bad))
        try:
            found = mbs.runtime.load_program(path)(jnp.ones(2))
        except ValueError as error:
            assert "sine" in str(error)
        else:
            np.testing.assert_allclose(found, np.sin(np.ones(2)))
    with pytest.raises(ValueError, match="is no file"):
        mbs.runtime.load_program(tmp_path)


class Ran(Exception):
    pass


class Trap(eqx.Module):
    """Whose functions raise: reading a file calls none of them."""

    x: jax.Array
    name: str = eqx.field(static=True)

    def __init__(self, *args):
        raise Ran

    __setstate__ = __reduce__ = __init__


def test_reading_runs_nothing(tmp_path):
    trap = object.__new__(Trap)
    object.__setattr__(trap, "x", 0)
    object.__setattr__(trap, "name", "a")
    found = from_data(json.loads(json.dumps(to_data({"trap": (trap, None, 0.1)}))))
    assert isinstance(found["trap"][0], Trap) and found["trap"][0].name == "a" and found["trap"][2] == 0.1
    for data in (
        {"object": "os:system", "fields": {}},
        {"object": "subprocess:Popen", "fields": {"args": "true"}},
        {"class": "jaxmbs.runtime._jit:jit"},
        {"record": "builtins:str", "items": []},
        {"object": "antigravity:x", "fields": {}},
        {"object": f"{__name__}:Trap", "fields": {"__class__": 1}},
        {"call": "print"},
        ["list"],
    ):
        with pytest.raises((ValueError, TypeError)):
            from_data(data)
    assert "antigravity" not in sys.modules


def test_results_of_every_kind_come_back():
    """Structure and settings as they were, through the text of JSON."""
    system = mbs.LinearSystem(mass=jnp.eye(2), stiffness=jnp.eye(2), coordinates=["x", "y"])
    values = {
        "modes": mbs.modes(system),
        "tuple": (1, None, [True, "a"]),
        "status": mbs.Status.EVENT,
        "names": frozenset({"a", "b"}),
        "numbers": np.array([1.0, np.nan, np.inf]),
        "type": np.dtype("float32"),
        "keys": {3: -0.0, 4: 1},
        "internal": mbs.model.InternalStates(
            jnp.ones(3), (InternalRecord("a.p", (), "Pa", 0), InternalRecord("b.z", (2,), "m", 1))
        ),
    }
    found = from_data(json.loads(json.dumps(to_data(values))))
    assert jax.tree.structure(found) == jax.tree.structure(values)
    for one, other in zip(jax.tree.leaves(found), jax.tree.leaves(values), strict=True):
        np.testing.assert_array_equal(one, other)
