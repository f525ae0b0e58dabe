"""What `import jaxmbs` loads, and that names which come when asked are those that were always there."""

import gc
import importlib
import inspect
import json
import os
import pickle
import subprocess
import sys
import textwrap
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from jaxmbs import lazy
from jaxmbs.verbs._dispatch import Verb
from tests.test_public_faces import FACES

ROOT = Path(__file__).parent.parent
LATE = {  # third parties that `import jaxmbs` leaves alone
    *("scipy", "diffrax", "optimistix", "lineax", "optax", "tqdm", "matplotlib", "networkx", "xarray", "zarr"),
    *("dask", "distributed", "mujoco", "pinocchio", "pyyeti", "pyuff", "meshio", "skfem", "nlopt", "viser"),
    *("openmdao", "tesseract_core", "control", "fmpy", "IPython", "pandas"),
}
OWN = {"lazy", "typing", "errors", "checks", "arguments", "atomic_write", "runtime"}  # that `import jaxmbs` runs
MOST_FILES_OF_AN_ANSWER = 275
MOST_FILES = 96  # of them, most of `runtime`; of every room there are more than 700


def _answer(program):
    """What a program prints as JSON in a process of its own."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, env=environment, timeout=300
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_import_loads_jax_and_little_else():
    loaded = _answer("import jaxmbs, json, sys; print(json.dumps(sorted(sys.modules)))")
    assert not LATE & {name.partition(".")[0] for name in loaded}
    own = [name for name in loaded if name.startswith("jaxmbs.")]
    assert {name.split(".")[1] for name in own} == OWN
    assert len(own) <= MOST_FILES, own


@pytest.mark.long
@pytest.mark.parametrize("name", ["State", "LinearSystem", "modes", "equilibrium", "reactions", "fatigue.damage"])
def test_what_integrates_nothing_loads_no_solver(name):
    loaded = _answer(f"import jaxmbs, json, sys; jaxmbs.{name}; print(json.dumps(sorted(sys.modules)))")
    late = LATE - {"scipy"}
    assert not late & {name.partition(".")[0] for name in loaded}


_PENDULUM = """
import json, sys
import jax
import jaxmbs
jax.config.update("jax_enable_x64", True)
b = jaxmbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
b.body("bob", mass=1.0, com=(0.0, -1.0, 0.0))
b.joint("pin", jaxmbs.Revolute("z"), "ground", "bob")
system = b.build()
motion = jaxmbs.simulate(system, jaxmbs.State.at(system, pin=0.3), t1=0.5)
force = jaxmbs.reactions(system, motion)["pin"].force
print(json.dumps([force.tolist(), sorted(sys.modules)]))
"""


@pytest.mark.slow
def test_an_answer_of_the_store_loads_what_it_needs(tmp_path, monkeypatch):
    """No solver, no SciPy, no linear systems, no equations of motion: those are in the tapes."""
    monkeypatch.setenv("JAXMBS_STORE", str(tmp_path))
    (first, _), (second, loaded) = _answer(_PENDULUM), _answer(_PENDULUM)
    assert second == first
    assert not LATE & {name.partition(".")[0] for name in loaded}
    own = [name for name in loaded if name.startswith("jaxmbs.")]
    assert not {"coupling", "linear", "vibration", "statics"} & {
        name.split(".")[1] for name in own if name.count(".") > 1
    }
    assert len(own) <= MOST_FILES_OF_AN_ANSWER, own


@pytest.mark.parametrize("room", [*FACES, "jaxmbs.verbs", "jaxmbs.dynamics.paper"])
def test_every_public_name_is_imported_for_readers(room):
    """The imports under `TYPE_CHECKING` are those of the face, and say where each name comes from."""
    module = importlib.import_module(room)
    if not isinstance(module, lazy.Room):
        return
    origins = lazy.origins(module)
    rooms = {name for name in module.__all__ if importlib.util.find_spec(f"{room}.{name}")}
    assert set(module.__all__) - rooms <= set(origins) <= {*module.__all__, "ALL", "Modal"}
    for name, (file, original) in origins.items():
        assert getattr(module, name) is getattr(importlib.import_module(file), original)


FILES = {
    "__init__": """
        from typing import TYPE_CHECKING
        from jaxmbs.lazy import import_when_asked
        ORDER = []
        if TYPE_CHECKING:
            from . import inner
            from ._one import first, second as other
            from ._two import third
            from ._faulty import fault
        __all__ = ["first", "other", "third", "inner", "fault"]
        import_when_asked(__name__, lambda module, names: ORDER.append(sorted(set(names) & module.keys())))
    """,
    "_one": "import time; time.sleep(0.05); first, second, private = object(), object(), 3",
    "_two": "from ._one import first; third = [first]",
    "inner": "x = 1",
    "_faulty": "import no_such_library_anywhere",
    "_unlisted": "y = 2",
}


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A room in a package of its own, of which nothing has been asked."""
    folder = tmp_path / "lazy_room"
    folder.mkdir()
    for name, text in FILES.items():
        (folder / f"{name}.py").write_text(textwrap.dedent(text))
    monkeypatch.syspath_prepend(str(tmp_path))
    yield importlib.import_module("lazy_room")
    for name in [name for name in sys.modules if name.partition(".")[0] == "lazy_room"]:
        del sys.modules[name]


def _loaded():
    return {name.partition(".")[2] for name in sys.modules if name.startswith("lazy_room.")}


def test_a_file_is_imported_with_its_first_name(package):
    assert not _loaded()
    first = package.first
    assert _loaded() == {"_one"} and vars(package)["first"] is first is package._one.first
    assert package.other is package._one.second and _loaded() == {"_one"}
    assert package.third == [first] and _loaded() == {"_one", "_two"}
    assert package.inner.x == 1 and package._unlisted.y == 2


def test_the_room_prepares_names_before_anyone_has_them(package):
    importlib.import_module("lazy_room._two")
    assert package.ORDER == [["first"], ["first", "third"]]
    assert package.other and package.ORDER[-1] == ["other"]


def test_names_that_are_not_there(package):
    with pytest.raises(AttributeError, match="module 'lazy_room' has no attribute 'forth'"):
        package.forth  # noqa: B018
    assert not any(hasattr(package, name) for name in ("__wrapped__", "private", "_one.first", "inner.x", "a b"))
    with pytest.raises(ImportError, match="cannot import name 'forth'"):
        exec("from lazy_room import forth")


def test_a_library_that_a_file_lacks_is_named(package):
    with pytest.raises(ModuleNotFoundError, match="no_such_library_anywhere"):
        package.fault  # noqa: B018


def test_all_names_are_listed_before_they_are_loaded(package):
    assert dir(package) == sorted(package.__all__) and not _loaded()


def test_threads_that_ask_at_once_get_one_object(package):
    names = ["first", "other", "third"] * 8
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda name: getattr(package, name), names))
    assert all(item is getattr(package, name) for name, item in zip(names, found, strict=True))


def test_the_garbage_collector_is_left_as_it_was(package):
    assert gc.isenabled() and package.first and gc.isenabled()
    gc.disable()
    try:
        assert package.third and not gc.isenabled()
    finally:
        gc.enable()


_THREADS = """
import json, random, sys, threading
import jaxmbs
names = [(room, name) for room in ("jaxmbs", "jaxmbs.viz", "jaxmbs.forces", "jaxmbs.qualification", "jaxmbs.io")
         for name in __import__(room, fromlist=["__all__"]).__all__]
found, faults = [], []
def ask(seed):
    mine = random.Random(seed).sample(names, len(names))
    try:
        found.append({f"{room} {name}": getattr(sys.modules[room], name) for room, name in mine})
    except Exception as error:
        faults.append(repr(error))
threads = [threading.Thread(target=ask, args=(seed,)) for seed in range(8)]
[thread.start() for thread in threads], [thread.join() for thread in threads]
print(json.dumps([faults, [key for key in found[0] if len({id(each[key]) for each in found}) > 1]]))
"""

_TRACED = """
import json
import jax
import jaxmbs
jax.config.update("jax_enable_x64", True)
def question(x):
    for room in jaxmbs.__all__:
        module = getattr(jaxmbs, room)
        [getattr(module, name) for name in getattr(module, "__all__", ())]
    b = jaxmbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    b.body("bob", mass=1.0, com=(0.0, -x, 0.0))
    b.joint("pin", jaxmbs.Revolute("z"), "ground", "bob")
    system = b.build()
    motion = jaxmbs.simulate(system, jaxmbs.State.at(system, pin=0.3), t1=0.5)
    return motion.states.coordinates[-1, 0]
print(json.dumps([float(jax.jit(question)(1.0)), float(question(1.0))]))
"""


@pytest.mark.long
def test_threads_that_ask_for_everything():
    assert _answer(_THREADS) == [[], []]


@pytest.mark.long
def test_files_imported_inside_of_a_trace_keep_nothing_of_it():
    inside, after = _answer(_TRACED)
    assert inside == pytest.approx(after, rel=1e-12)


def pickled():
    """Public things as pickles, by "room name"."""
    found = {}
    for room in FACES:
        module = importlib.import_module(room)
        for name in module.__all__:
            item = getattr(module, name)
            if inspect.isfunction(item) or inspect.isclass(item) or isinstance(item, Verb):
                found[f"{room} {name}"] = pickle.dumps(item)
    return found


def test_pickles_of_public_things_are_the_things():
    for place, data in pickled().items():
        room, name = place.split()
        assert pickle.loads(data) is getattr(sys.modules[room], name), place


@pytest.mark.long
@pytest.mark.parametrize("place", ["jaxmbs simulate", "jaxmbs.fatigue damage", "jaxmbs Revolute", "jaxmbs.viz scene"])
def test_a_new_process_reads_a_pickle_before_it_asks_for_anything(place):
    data, (room, name) = pickled()[place].hex(), place.split()
    program = f"import pickle, json, importlib; item = pickle.loads(bytes.fromhex({data!r})); "
    program += f"print(json.dumps(item is getattr(importlib.import_module({room!r}), {name!r})))"
    assert _answer(program) is True


def _moved():
    """(old place, new place) of names that have moved."""
    rooms = [importlib.import_module(room) for room in FACES]
    moved = [(room, name, new) for room in rooms for name, new in vars(room).get("_moved", {}).items()]
    return [(f"{room.__name__}.{name}", f"{new}.{name}") for room, name, new in moved]


@pytest.mark.parametrize(("old", "new"), _moved())
def test_names_that_have_moved_come_with_a_warning(old, new):
    (room, name), (home, _) = (place.rsplit(".", 1) for place in (old, new))
    room, home = importlib.import_module(room), importlib.import_module(home)
    with pytest.warns(DeprecationWarning, match=f"{old} is deprecated; it is {new}"):
        found = getattr(room, name)
    assert found is getattr(home, name) and name in home.__all__ and name not in dir(room)
