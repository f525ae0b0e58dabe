"""Studies: what stands in the dataset, and that neither kills, other writers nor full disks spoil a store."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.errors import BatchError
from jaxmbs.studies import StudyError, grid, latin_hypercube, sobol
from jaxmbs.studies import _store as store
from jaxmbs.studies import _study as study
from jaxmbs.studies import sweep as sweep_with_bar
from jaxmbs.studies._store import StudyStore, chunk_spans

pytest.importorskip("xarray")
CHILD = Path(__file__).parent / "killed_study.py"


def sweep(*args, **options):
    return sweep_with_bar(*args, progress=False, **options)


def answers(design):
    x, y = design["x"], design["y"]
    return {"sum": x + 100.0 * y, "powers": jnp.stack([x, x**2, x**3]), "root": jnp.sqrt(x - 2.0)}


def test_a_grid_has_a_dimension_for_every_variable(tmp_path):
    plan = grid(x=np.arange(6.0), y=[1.0, 2.0])
    options = {"dims": {"powers": ("exponent",)}, "coords": {"exponent": [1, 2, 3]}, "units": {"x": "m", "sum": "N"}}
    found = sweep(answers, plan, tmp_path / "study", chunk=5, **options)
    assert found["sum"].dims == ("x", "y") and found["powers"].dims == ("x", "y", "exponent")
    assert float(found["sum"].sel(x=4.0, y=2.0)) == 204.0
    assert float(found["powers"].sel(x=3.0, y=1.0, exponent=3)) == 27.0
    assert found["x"].attrs["units"] == "m" and found["sum"].attrs["units"] == "N"
    bad = found["status"].values != 0
    np.testing.assert_array_equal(bad, np.repeat(np.arange(6)[:, None] < 2, 2, axis=1))  # the root has no value
    assert "not finite" in str(found["reason"].sel(x=0.0, y=1.0).item())
    assert float(found["sum"].sel(x=0.0, y=1.0)) == 100.0  # a row that fails stays
    again = sweep(answers, plan, tmp_path / "study", chunk=5, **options)
    assert found.identical(again)


def test_tables_and_points(tmp_path):
    table = {"x": np.array([3.0, 4.0]), "y": np.array([0.5, 0.25])}
    found = sweep(answers, table)
    assert found["sum"].dims == ("design",)
    np.testing.assert_array_equal(found["sum"], [53.0, 29.0])
    np.testing.assert_array_equal(found["x"], table["x"])
    rows = [{"x": 3.0, "y": 0.5}, {"x": 4.0, "y": 0.25}]
    assert sweep(answers, rows).identical(found)
    for plan in (
        sobol({"x": (2.0, 4.0), "y": (0.0, 1.0)}, 16),
        latin_hypercube({"x": (2.0, 4.0), "y": (0.0, 1.0)}, 16),
    ):
        x = plan.designs["x"]
        assert np.array_equal(np.sort(np.floor((x - 2.0) * 8).astype(int)), np.arange(16))  # one in every slice


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: grid(), "none are given"),
        (lambda: grid(x=3.0), "one row of numbers for each variable: x"),
        (lambda: sobol({"x": (1.0, 0.0)}, 4), "bounds must be finite"),
        (lambda: sobol({"x": (0.0, np.inf)}, 4), "bounds must be finite"),
        (lambda: latin_hypercube({"x": (0.0, 1.0)}, 0), "at least one design"),
    ],
)
def test_faults_of_plans(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_faults(tmp_path):
    with pytest.raises(TypeError, match="need names"):
        sweep(lambda d: {"y": d[0]}, (np.arange(3.0),))
    with pytest.raises(TypeError, match="a dict of arrays"):
        sweep(lambda d: {}, {"x": np.arange(3.0)})
    with pytest.raises(ValueError, match="dims of 'y'"):
        sweep(lambda d: {"y": d["x"]}, {"x": np.arange(3.0)}, dims={"y": ("time",)})
    for options, message in (
        ({"dims": {"z": ()}}, "no answer 'z'"),
        ({"coords": {"time": [1.0]}}, "no dimension 'time'"),
        ({"dims": {"y": ("time",)}, "coords": {"time": [1.0]}}, "coords of 'time' have the shape"),
        ({"units": {"yy": "m"}}, "no answer, variable or coordinate 'yy': did you mean 'y'"),
    ):
        with pytest.raises(ValueError, match=message):
            sweep(lambda d: {"y": jnp.stack([d["x"], d["x"]])}, {"x": np.arange(3.0)}, **options)
    with pytest.raises(ValueError, match="the answer 'x' has the name of a variable"):
        sweep(lambda d: {"x": 2.0 * d["x"]}, {"x": np.arange(3.0)})
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(StudyError, match="is no study"):
        sweep(lambda d: {"y": d["x"]}, {"x": np.arange(3.0)}, tmp_path)
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_another_study_is_refused(tmp_path):
    path, plan = tmp_path / "study", {"x": np.arange(1.0, 4.0)}
    first = sweep(lambda d: {"y": d["x"]}, plan, path)
    with pytest.raises(StudyError, match="differs in designs"):
        sweep(lambda d: {"y": d["x"]}, {"x": np.arange(2.0, 5.0)}, path)
    with pytest.raises(StudyError, match="differs in answers"):
        sweep(lambda d: {"z": d["x"]}, plan, path)
    with pytest.raises(StudyError, match="differs in key"):
        sweep(lambda d: {"y": d["x"]}, plan, path, key="2")
    for other in (  # the first design, 1, answers 1 to all of them
        lambda d: {"y": d["x"] ** 2},
        lambda d: {"y": jnp.where(d["x"] > 2.0, 5.0, d["x"])},
        lambda d: {"y": jnp.interp(d["x"], jnp.arange(4.0), jnp.array([0.0, 1.0, 2.0, 3.0 + 1e-9]))},
    ):
        with pytest.raises(StudyError, match="differs in function"):
            sweep(other, plan, path)

    def of_another_name(design):
        return {"y": design["x"]}

    assert sweep(of_another_name, plan, path).identical(first)


def test_two_writers(tmp_path):
    shape = {"y": np.zeros(()), "status": np.zeros((), np.int32)}
    first, second = (StudyStore(tmp_path / "study", chunk_spans(4, 2), shape, {}) for _ in range(2))
    with first.writing(), pytest.raises(StudyError, match="written by another process"), second.writing():
        pass
    with second.writing():
        pass


def test_a_full_disk_keeps_what_was_written(tmp_path, monkeypatch):
    path, plan, write = tmp_path / "study", {"x": np.arange(10.0)}, store.write_atomic

    def full(path, content):
        if path.name == "000002":
            raise OSError(28, "No space left on device")
        write(path, content)

    monkeypatch.setattr(store, "write_atomic", full)
    with pytest.raises(StudyError, match="No space left on device; 8 of 10 designs are kept, run the same"):
        sweep(lambda d: {"y": d["x"] ** 2}, plan, path, chunk=4)
    monkeypatch.undo()
    calls = watched(monkeypatch)
    found = sweep(lambda d: {"y": d["x"] ** 2}, plan, path, chunk=4)
    assert calls == [2]
    np.testing.assert_array_equal(found["y"], np.arange(10.0) ** 2)


def watched(patch):
    """Numbers of the chunks that are written."""
    calls, write = [], StudyStore.write
    patch.setattr(
        StudyStore, "write", lambda self, number, arrays: (calls.append(number), write(self, number, arrays))
    )
    return calls


def cut(file, chance):
    file.write_bytes(file.read_bytes()[: chance.randrange(file.stat().st_size)])


def flipped(file, chance):
    content = bytearray(file.read_bytes())
    content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
    file.write_bytes(content)


def of_another_chunk(file, chance):
    file.write_bytes((file.parent / "000000").read_bytes())


@pytest.mark.parametrize("harm", [Path.unlink, cut, flipped, of_another_chunk])
def test_chunks_that_do_not_fit_are_computed_again(tmp_path, monkeypatch, harm):
    """Removed, cut, with a bit flipped, in another's place: the same numbers, and only these are computed."""
    path, chance = tmp_path / "study", random.Random(3)
    plan = grid(x=np.arange(6.0), y=np.arange(3.0))
    whole = sweep(answers, plan, path, chunk=3)
    for _ in range(4):
        victims = chance.sample(range(1, 6), 2)
        for number in victims:
            file = path / "chunks" / f"{number:06d}"
            harm(file) if harm is Path.unlink else harm(file, chance)
        with monkeypatch.context() as patch:
            calls = watched(patch)
            assert sweep(answers, plan, path, chunk=3).identical(whole)
        assert calls == sorted(victims)


def test_files_of_others_in_the_folder_do_no_harm(tmp_path):
    path, plan = tmp_path / "study", {"x": np.arange(5.0)}
    first = sweep(lambda d: {"y": d["x"]}, plan, path, chunk=2)
    (path / "chunks" / "notes").write_text("mine")
    (path / "chunks" / ".000001-half").write_text("half")
    (path / "notes.txt").write_text("mine")
    (path / "chunks" / "000001").unlink()
    assert sweep(lambda d: {"y": d["x"]}, plan, path, chunk=2).identical(first)
    assert (path / "chunks" / "notes").exists() and not (path / "chunks" / ".000001-half").exists()
    (path / "study.json").write_text("{half")
    with pytest.raises(StudyError, match=r"study.json says no longer .* put it back, or delete"):
        sweep(lambda d: {"y": d["x"]}, plan, path, chunk=2)
    with pytest.raises(StudyError, match="is no study"):
        sweep(lambda d: {"y": d["x"]}, plan, path / "notes.txt")


def test_a_finished_study_asks_nothing_of_the_disk(tmp_path, monkeypatch):
    """It can be read where nothing can be written, and while another process holds it."""
    path, plan = tmp_path / "study", {"x": np.arange(5.0)}
    first = sweep(lambda d: {"y": d["x"]}, plan, path, chunk=2)

    def read_only(*args, **options):
        raise OSError(30, "Read-only file system")

    for owner, name in ((store, "write_atomic"), (Path, "mkdir"), (Path, "unlink"), (StudyStore, "writing")):
        monkeypatch.setattr(owner, name, read_only)
    assert sweep(lambda d: {"y": d["x"]}, plan, path, chunk=2).identical(first)
    monkeypatch.undo()
    (path / "chunks" / "000001").unlink()
    monkeypatch.setattr(Path, "mkdir", read_only)
    with pytest.raises(StudyError, match="cannot be written: Read-only file system"):
        sweep(lambda d: {"y": d["x"]}, plan, path, chunk=2)


def test_an_interrupt_says_what_is_kept(tmp_path, monkeypatch):
    plan, write = {"x": np.arange(6.0)}, StudyStore.write

    def interrupted(self, number, arrays):
        if number == 2:
            raise KeyboardInterrupt
        write(self, number, arrays)

    monkeypatch.setattr(StudyStore, "write", interrupted)
    with pytest.raises(StudyError, match="interrupted; 4 of 6 designs are kept, run the same study again to go on"):
        sweep(lambda d: {"y": d["x"]}, plan, tmp_path / "study", chunk=2)
    monkeypatch.undo()

    def stopped(*args, **options):
        raise BatchError("stopped") from KeyboardInterrupt()

    monkeypatch.setattr(study, "evaluate_batch", stopped)
    with pytest.raises(StudyError, match="interrupted; 4 of 6 designs are kept"):
        sweep(lambda d: {"y": d["x"]}, plan, tmp_path / "study", chunk=2)
    with pytest.raises(StudyError, match="interrupted; without a folder only `study`"):
        sweep(lambda d: {"y": d["x"]}, plan, chunk=2)


def test_tables_with_names_of_the_result(tmp_path):
    """A column "design" numbers the designs; "status" and "reason" are taken."""
    table = {"design": np.array([7.0, 3.0]), "x": np.array([1.0, 2.0])}
    found = sweep(lambda d: {"y": 2.0 * d["x"] + d["design"]}, table)
    assert float(found["y"].sel(design=3.0)) == 7.0 and float(found["x"].sel(design=7.0)) == 1.0
    assert sweep(lambda d: {"y": d["design"]}, grid(design=[4.0, 5.0]))["y"].sel(design=5.0) == 5.0
    for name in ("status", "reason"):
        with pytest.raises(ValueError, match=f"a variable is called '{name}'"):
            sweep(lambda d: {"y": d["x"]}, {"x": np.arange(2.0), name: np.arange(2.0)})
    with pytest.raises(ValueError, match="'design' has several numbers"):
        sweep(lambda d: {"y": d["x"]}, {"x": np.arange(2.0), "design": np.zeros((2, 2))})
    with pytest.raises(ValueError, match="dims of 'y'.*differ from each other and from"):
        sweep(lambda d: {"y": jnp.zeros(2) * d["x"]}, grid(x=[1.0]), dims={"y": ("x",)})
    for chunk in (0, -1):
        with pytest.raises(ValueError, match="chunk must be at least 1"):
            sweep(lambda d: {"y": d["x"]}, {"x": np.arange(2.0)}, chunk=chunk)


def killed(path, kills, seed):
    """Run the study in processes that are killed at random moments; the chunks written by each of them."""
    chance, written = random.Random(seed), []
    while True:
        child = subprocess.Popen([sys.executable, str(CHILD), str(path)], stdout=subprocess.PIPE, text=True)
        lines = []
        if kills > 0:
            for _ in range(chance.randrange(1, 3)):
                lines.append(child.stdout.readline().strip())
            time.sleep(chance.random() * 0.02)
            os.kill(child.pid, signal.SIGKILL)
            kills -= 1
        lines += child.communicate()[0].split()
        written.append([int(line) for line in lines if line.isdigit()])
        if lines[-1:] == ["end"]:
            return written


@pytest.mark.parametrize("kills", [pytest.param(3, marks=pytest.mark.long), pytest.param(50, marks=pytest.mark.long)])
def test_killed_and_continued(tmp_path, kills):
    """Same numbers, nothing lost and no chunk twice but the one in hand."""
    path = tmp_path / "study"
    written = killed(path, kills, 1)
    every = sum(written, [])
    assert len(written) > 3 and len(every) == len(set(every))  # what was told as written is not written again
    sys.path.insert(0, str(CHILD.parent))
    from tests.studies import killed_study

    whole = sweep(killed_study.answers, killed_study.PLAN, tmp_path / "whole", chunk=7)
    continued = sweep(killed_study.answers, killed_study.PLAN, path, chunk=7)
    assert continued.identical(whole)
    assert not np.any(continued["status"].values == mbs.Status.NOT_RUN)


@pytest.mark.long
def test_workers_of_dask(tmp_path):
    """Chunks on two workers, of which one is killed: the same numbers."""
    distributed = pytest.importorskip("distributed")
    plan = grid(x=np.arange(40.0), y=np.arange(5.0))
    with (
        distributed.LocalCluster(2, threads_per_worker=1, dashboard_address=None) as cluster,
        cluster.get_client() as client,
    ):
        pids = list(client.run(os.getpid).values())
        slow = {"dims": {"powers": ("exponent",)}, "chunk": 8, "client": client}
        write = StudyStore.write
        with pytest.MonkeyPatch.context() as patch:
            kill = iter([lambda: os.kill(pids[0], signal.SIGKILL)])
            patch.setattr(StudyStore, "write", lambda *args: (next(kill, lambda: None)(), write(*args)))
            found = sweep(answers, plan, tmp_path / "study", **slow)
    assert found.identical(sweep(answers, plan, dims={"powers": ("exponent",)}))


def test_designs_of_like_cost_are_told_apart(tmp_path, monkeypatch):
    """`cost=` reaches the batch: dear designs run first once some have run."""
    from jaxmbs.batching import _executor as chunks

    orders, before = [], chunks.costliest_first

    def watched(designs, asked, ran, costs):
        orders.append((asked, costs[ran]))
        return before(designs, asked, ran, costs)

    monkeypatch.setattr(chunks, "costliest_first", watched)
    n = np.arange(4096.0)
    found = sweep(lambda d: {"work": 2.0 * d["n"]}, {"n": n}, tmp_path / "s", chunk=4096, cost=lambda a: a["work"])
    np.testing.assert_array_equal(found["work"], 2.0 * n)
    assert len(orders) > 1 and all(np.all(np.isin(costs, 2.0 * n)) for _, costs in orders)
    assert np.ptp(orders[-1][1]) > 0.0


@pytest.mark.parametrize("folder", [None, "study"])
def test_an_interrupted_study_keeps_what_was_computed(folder, tmp_path, monkeypatch):
    """Chunks that are done, and the part of the one that is not; what was not computed says so."""
    evaluate, calls = study.evaluate_batch, []

    def stopped(*args, **options):
        found = evaluate(*args, **options)
        calls.append(1)
        if len(calls) == 2:
            status = np.where(np.arange(len(found.status)) < 1, found.status, mbs.Status.NOT_RUN)
            part = eqx.tree_at(lambda batch: batch.status, found, status)
            raise BatchError("stopped", part) from KeyboardInterrupt()
        return found

    monkeypatch.setattr(study, "evaluate_batch", stopped)
    path = None if folder is None else tmp_path / folder
    with pytest.raises(StudyError, match="interrupted") as caught:
        sweep(lambda d: {"y": 2.0 * d["x"]}, {"x": np.arange(6.0)}, path, chunk=2)
    found = caught.value.study
    assert list(found["reason"].values) == ["success"] * 3 + ["not computed"] * 3
    np.testing.assert_array_equal(found["y"][:3], [0.0, 2.0, 4.0])
    assert np.all(np.isnan(found["y"][4:]))
