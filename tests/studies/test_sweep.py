"""Studies: what stands in the dataset, and that neither kills, other writers nor full disks spoil a store."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.studies import StudyError, grid, latin_hypercube, sobol
from jaxmbs.studies import sweep as sweep_with_bar
from jaxmbs.studies.store import Store

pytest.importorskip("zarr")
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
        (lambda: sobol({"x": (1.0, 0.0)}, 4), "bounds are finite"),
        (lambda: sobol({"x": (0.0, np.inf)}, 4), "bounds are finite"),
        (lambda: latin_hypercube({"x": (0.0, 1.0)}, 0), "at least one design"),
    ],
)
def test_faults_of_plans(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_faults(tmp_path):
    with pytest.raises(TypeError, match="names its variables"):
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
    with pytest.raises(StudyError, match="answers of another function: 'y'"):
        sweep(lambda d: {"y": 2.0 * d["x"]}, plan, path)
    assert sweep(lambda d: {"y": d["x"]}, plan, path).identical(first)


def test_two_writers(tmp_path):
    shape = {"y": np.zeros(()), "status": np.zeros((), np.int32)}
    with Store(tmp_path / "study", 4, 2, shape, {}), pytest.raises(StudyError, match="written by another process"):
        Store(tmp_path / "study", 4, 2, shape, {})
    Store(tmp_path / "study", 4, 2, shape, {}).close()


def test_a_full_disk_keeps_what_was_written(tmp_path, monkeypatch):
    path, plan, write = tmp_path / "study", {"x": np.arange(10.0)}, Store.write

    def full(self, number, arrays):
        if number == 2:
            self.group = {name: Full() for name in arrays}
        write(self, number, arrays)

    class Full:
        def __setitem__(self, rows, values):
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(Store, "write", full)
    with pytest.raises(StudyError, match="No space left on device; 8 of 10 designs are kept"):
        sweep(lambda d: {"y": d["x"] ** 2}, plan, path, chunk=4)
    monkeypatch.undo()
    calls = []
    monkeypatch.setattr(
        Store, "write", lambda self, number, arrays: (calls.append(number), write(self, number, arrays))
    )
    found = sweep(lambda d: {"y": d["x"] ** 2}, plan, path, chunk=4)
    assert calls == [2]
    np.testing.assert_array_equal(found["y"], np.arange(10.0) ** 2)


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


@pytest.mark.parametrize("kills", [pytest.param(5, marks=pytest.mark.slow), pytest.param(50, marks=pytest.mark.long)])
def test_killed_and_continued(tmp_path, kills):
    """Same numbers, nothing lost and no chunk twice but the one in hand."""
    path = tmp_path / "study"
    written = killed(path, kills, 1)
    every = sum(written, [])
    assert len(written) > 3 and len(every) == len(set(every))  # what was told as written is not written again
    sys.path.insert(0, str(CHILD.parent))
    import killed_study

    whole = sweep(killed_study.answers, killed_study.PLAN, tmp_path / "whole", chunk=7)
    continued = sweep(killed_study.answers, killed_study.PLAN, path, chunk=7)
    assert continued.identical(whole)
    assert not np.any(continued["status"].values == mbs.Status.NOT_RUN)


@pytest.mark.slow
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
        write = Store.write
        with pytest.MonkeyPatch.context() as patch:
            kill = iter([lambda: os.kill(pids[0], signal.SIGKILL)])
            patch.setattr(Store, "write", lambda *args: (next(kill, lambda: None)(), write(*args)))
            found = sweep(answers, plan, tmp_path / "study", **slow)
    assert found.identical(sweep(answers, plan, dims={"powers": ("exponent",)}))


def test_designs_of_like_cost_are_told_apart(tmp_path, monkeypatch):
    """`cost=` reaches the batch: dear designs run first once some have run."""
    from jaxmbs.design import chunks

    orders, before = [], chunks.dearest_first

    def watched(designs, asked, ran, costs):
        orders.append((asked, costs[ran]))
        return before(designs, asked, ran, costs)

    monkeypatch.setattr(chunks, "dearest_first", watched)
    n = np.arange(4096.0)
    found = sweep(lambda d: {"work": 2.0 * d["n"]}, {"n": n}, tmp_path / "s", chunk=4096, cost=lambda a: a["work"])
    np.testing.assert_array_equal(found["work"], 2.0 * n)
    assert len(orders) > 1 and all(np.all(np.isin(costs, 2.0 * n)) for _, costs in orders)
    assert np.ptp(orders[-1][1]) > 0.0
