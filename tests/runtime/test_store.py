"""The store of programs: what is wrong with the folder or with a file never changes an answer."""

import errno
import os

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.runtime import _store, _stored_program, _tape_program
from jaxmbs.runtime._store import Store

KEY, CONTENT = "a" * 64, bytes(range(256)) * 40


@pytest.fixture
def store(tmp_path):
    return Store(tmp_path / "programs")


def test_what_is_written_is_read(store):
    assert store.read(KEY) is None
    store.write(KEY, CONTENT)
    assert store.read(KEY) == CONTENT and Store(store.folder).read(KEY) == CONTENT
    assert store.folder.stat().st_mode & 0o777 == 0o700
    store.remove(KEY)
    store.remove(KEY)
    assert store.read(KEY) is None and not list(store.folder.iterdir())


def changed(content, place):
    return content[:place] + bytes([content[place] ^ 16]) + content[place + 1 :]


DAMAGES = {
    "empty": lambda content: b"",
    "head": lambda content: content[:10],
    "cut off": lambda content: content[:-3],
    "longer": lambda content: content + b"0",
    "mark": lambda content: changed(content, 2),
    "digest": lambda content: changed(content, 30),
    "content": lambda content: changed(content, len(content) - 20),
    "another": lambda content: os.urandom(5000),
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_damaged_file_is_not_used_and_goes(store, damage):
    store.write(KEY, CONTENT)
    file = store.folder / KEY
    file.write_bytes(damage(file.read_bytes()))
    assert store.read(KEY) is None and not file.exists()


def test_a_file_under_another_name_is_not_used(store):
    store.write(KEY, CONTENT)
    other = "b" * 64
    (store.folder / KEY).rename(store.folder / other)
    assert store.read(other) is None


def refuse(number):
    def fail(*_, **__):
        raise OSError(number, os.strerror(number))

    return fail


@pytest.mark.parametrize("place", ["os.replace", "tempfile.mkstemp", "os.scandir"])
@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EROFS, errno.EACCES], ids=["full", "read-only", "denied"])
def test_a_folder_that_takes_nothing_is_left_alone(store, place, number, monkeypatch):
    monkeypatch.setattr(f"jaxmbs.runtime._store.{place}", refuse(number))
    store.write(KEY, CONTENT)
    monkeypatch.undo()
    assert store.folder is None
    store.write(KEY, CONTENT)
    assert store.read(KEY) is None


def test_a_folder_that_is_gone_is_left_alone(store):
    store.write(KEY, CONTENT)
    (store.folder / KEY).unlink()
    store.folder.rmdir()
    assert store.read(KEY) is None
    store.write(KEY, CONTENT)
    assert store.read(KEY) is None


def test_a_folder_that_others_can_write_to_is_not_used(tmp_path):
    folder = tmp_path / "open"
    folder.mkdir()
    folder.chmod(0o777)
    assert Store(folder).folder is None
    (tmp_path / "file").write_text("no folder")
    assert Store(tmp_path / "file").folder is None and Store(tmp_path / "file" / "in it").folder is None
    assert Store(None).read(KEY) is None


def test_files_that_are_not_used_go(tmp_path, monkeypatch):
    monkeypatch.setattr(_store, "_LOOK_EVERY", 1)
    contents = {f"{k:064d}": os.urandom(20_000) for k in range(8)}
    store = Store(tmp_path / "small", size=90_000)
    for k, (key, content) in enumerate(contents.items()):
        store.write(key, content)
        os.utime(store.folder / key, (1000 + k, 1000 + k)) if (store.folder / key).exists() else None
        store.read(f"{0:064d}")  # used all the time
    kept = {file.name for file in store.folder.iterdir()}
    assert len(kept) == 4 and f"{0:064d}" in kept and f"{7:064d}" in kept and f"{1:064d}" not in kept


def test_the_environment_chooses_the_folder(tmp_path, monkeypatch):
    for setting, folder in (("off", None), (str(tmp_path / "here"), tmp_path / "here")):
        monkeypatch.setenv("JAXMBS_STORE", setting)
        _store.store.cache_clear()
        assert _store.store().folder == folder
    monkeypatch.delenv("JAXMBS_STORE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    _store.store.cache_clear()
    assert _store.store().folder == tmp_path / "cache" / "jaxmbs" / "programs"
    monkeypatch.undo()
    _store.store.cache_clear()


class Law(eqx.Module):
    stiffness: float

    def __call__(self, x, v, t):
        return -self.stiffness * x


@pytest.fixture
def process(store, monkeypatch):
    """A function that runs another one as a process that begins does, and counts what it traces."""
    monkeypatch.setattr(_stored_program, "store", lambda: store)
    traced, begun = [], set()
    trace, program = _tape_program.TapeFunction._trace, _tape_program.TapeFunction.program

    def begin(self, *args):  # what a function of the library has from other tests and processes
        if self not in begun:
            self._programs.clear()
            begun.add(self)
        return program(self, *args)

    def counted(self, *args):
        traced.append(self)
        return trace(self, *args)

    monkeypatch.setattr(_tape_program.TapeFunction, "_trace", counted)
    monkeypatch.setattr(_tape_program.TapeFunction, "program", begin)

    def run(function):
        _tape_program._PROGRAMS.clear()
        traced.clear(), begun.clear()
        return function(), len(traced)

    return run


def question(k=2.0):
    @mbs.jit
    def power(x, name):
        return {"sum": jnp.sum(k * x**2), "name": name, "kind": Law, "law": Law(k), "all": (x, None, 3)}

    return power(jnp.arange(3.0), "pin")


def test_a_second_process_traces_nothing(process):
    (first, traced), (second, again) = process(question), process(question)
    assert (traced, again) == (1, 0)
    assert first["sum"] == second["sum"] == 10.0
    assert (
        jax.tree.structure(first) == jax.tree.structure(second) and second["kind"] is Law and second["name"] == "pin"
    )
    other, traced = process(lambda: question(3.0))
    assert traced == 1 and other["sum"] == 15.0 and other["law"].stiffness == 3.0


def test_a_process_reads_its_own_programs(process):
    def twice():
        return [question()["sum"] for _ in range(2)]

    assert process(twice) == ([10.0, 10.0], 1)


def motion(k=5.0):
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    b.body("bob", mass=2.0, com=(0.0, 0.0, -1.0), inertia=(0.1, 0.1, 0.1))
    b.joint("pin", mbs.Revolute("y"), "ground", "bob")
    b.force("spring", mbs.Actuator(Law(k)), joint="pin")
    system = b.build()
    found = mbs.simulate(system, mbs.State.at(system, pin=0.3), ts=np.linspace(0.0, 0.5, 6))
    return found, mbs.reactions(system, found)["pin"].force


@pytest.mark.slow  # without the checks of types in the quick tests, whose wrappers have no content
def test_answers_of_a_mechanism_are_those_of_the_first_process(process):
    (first, traced), (second, again) = process(motion), process(motion)
    assert traced > 1 and again == 0
    assert all(
        np.array_equal(a, b, equal_nan=True) for a, b in zip(*map(jax.tree.leaves, (first, second)), strict=True)
    )
    assert jax.tree.structure(first) == jax.tree.structure(second)
    assert process(lambda: motion(6.0))[1] == 0  # a number of a law is a number


def test_a_program_that_answers_otherwise_is_traced_again(process, store, monkeypatch):
    """As one of a machine whose functions are not what they were."""
    first, _ = process(question)
    monkeypatch.setattr(_stored_program, "_agree", lambda one, other: False)
    second, traced = process(question)
    assert traced == 1 and second["sum"] == first["sum"]


def test_a_program_is_asked_its_own_question_once(process, store):
    sizes = []
    for _ in range(3):
        process(question)
        (file,) = store.folder.iterdir()
        sizes.append(len(store.read(file.name)))
    assert sizes[0] > sizes[1] == sizes[2]


def test_results_that_are_no_data_are_not_stored(process):
    def no_data():
        return mbs.jit(lambda x: (2.0 * x, jax.tree_util.Partial(lambda y: y * 2.0)))(jnp.ones(2))[0]

    for _ in range(2):
        found, traced = process(no_data)
        assert traced == 1 and np.array_equal(found, [2.0, 2.0])


def test_what_has_no_content_is_traced(process):
    table = np.random.default_rng(0)

    def drawn():
        return mbs.jit(lambda x: x * np.loadtxt(["3.0"]).item() + float(table.integers(1)))(jnp.ones(()))

    assert [process(drawn) for _ in range(2)] == [(3.0, 1), (3.0, 1)]


def search():
    def objective(design):
        return jnp.sum((design["length"] - 2.0) ** 2), {"size": design["length"]}

    limit = mbs.Limit("largest", "size", upper=1.5)
    return mbs.minimise(objective, {"length": 1.0}, steps=20, limits=[limit], progress=False)


# without the checks of types in the quick tests, whose wrappers have no content
@pytest.mark.slow
def test_a_search_begins_without_a_trace(process, monkeypatch):
    first, traced = process(search)
    monkeypatch.setattr(jax, "make_jaxpr", None)
    second, again = process(search)
    assert traced == 1 and again == 0
    assert second.design["length"] == first.design["length"] == pytest.approx(1.5)
    assert str(second) == str(first)


def tolerance_shares():
    return mbs.design.tolerances(lambda x: jnp.sum(x["a"] ** 2), {"a": np.array([1.0, 2.0])}, {"a": np.ones(2)})


def uncertainty():
    return mbs.design.propagate_uncertainty(lambda x: x["a"] ** 2, {"a": 3.0}, {"a": 0.1})


@pytest.mark.slow
@pytest.mark.parametrize("asked", [tolerance_shares, uncertainty])
def test_questions_on_designs_begin_without_a_trace(asked, process, monkeypatch):
    first, _ = process(asked)
    monkeypatch.setattr(jax, "make_jaxpr", None)
    second, again = process(asked)
    assert again == 0 and str(second) == str(first)
