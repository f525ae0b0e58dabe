"""Studies opened without their function, whole, stopped and damaged; fronts against the definition."""

import json
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.studies import StudyError, grid, pareto_front, sobol

xarray = pytest.importorskip("xarray")
TIMES = np.linspace(0.0, 1.0, 4)
PLANS = {
    "grid": grid(a=[1.0, 2.0, 3.0], b=[0.5, 1.5]),
    "points": sobol({"a": (1.0, 3.0), "b": (0.5, 1.5)}, 8),
    "table": {"a": np.arange(5.0), "b": np.ones((5, 2)), "design": np.arange(10, 15)},
}


def answers(design):
    a, b = design["a"], jnp.sum(design["b"])
    return {"curve": a * jnp.asarray(TIMES) + b, "nested": {"size": a * b, "count": jnp.asarray(3)}}


def run(path, plan, **options):
    names = {"dims": {"curve": ("time",)}, "coords": {"time": TIMES}, "units": {"curve": "N", "a": "m", "time": "s"}}
    return mbs.sweep(answers, PLANS[plan], path, chunk=2, progress=False, **names, **options)


@pytest.mark.parametrize("plan", PLANS)
def test_an_opened_study_is_what_the_sweep_returned(tmp_path, plan):
    found = run(tmp_path / "study", plan)
    xarray.testing.assert_identical(mbs.studies.open(tmp_path / "study"), found)


def test_a_stopped_study_says_what_is_not_there(tmp_path):
    found = run(tmp_path / "study", "points")
    (tmp_path / "study" / "chunks" / "000001").unlink()
    half = mbs.studies.open(tmp_path / "study")
    there = np.asarray(half["status"] == 0)
    assert there.tolist() == [True] * 2 + [False] * 2 + [True] * 4
    assert set(half["reason"].values[~there]) == {"not computed"} and np.all(np.isnan(half["curve"].values[~there]))
    np.testing.assert_array_equal(half["nested.size"].values[there], found["nested.size"].values[there])


def test_a_study_of_an_earlier_release_gets_its_layout_from_the_next_sweep(tmp_path):
    found = run(tmp_path / "study", "grid")
    (tmp_path / "study" / "layout.npz").unlink()
    with pytest.raises(StudyError, match="earlier release"):
        mbs.studies.open(tmp_path / "study")
    run(tmp_path / "study", "grid")
    xarray.testing.assert_identical(mbs.studies.open(tmp_path / "study"), found)


@pytest.mark.parametrize("file, content, words", [
    ("study.json", "half", "says no longer which study"),
    ("study.json", json.dumps({"rows": 3}), "says no longer which study"),
    ("study.json", None, "holds no study"),
    ("layout.npz", "half", "is damaged"),
])  # fmt: skip
def test_damaged_folders_are_named(tmp_path, file, content, words):
    run(tmp_path / "study", "grid")
    path = Path(tmp_path / "study" / file)
    path.unlink()
    if content is not None:
        path.write_text(content)
    with pytest.raises(StudyError, match=words):
        mbs.studies.open(tmp_path / "study")


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("maximise", [(), ("g",)])
def test_a_front_is_that_of_the_definition(seed, maximise):
    rng = np.random.default_rng(seed)
    values = rng.integers(0, 12, (60, 3)).astype(float) if seed % 2 else rng.normal(size=(60, 3))
    status = np.where(rng.random(60) < 0.2, int(mbs.Status.FAILED), 0)
    values[5, 1] = np.nan
    found = xarray.Dataset(
        {n: ("design", x) for n, x in zip("fgh", values.T, strict=True)} | {"status": ("design", status)}
    )
    front = pareto_front(found.assign_coords(design=np.arange(60)), ["f", "g", "h"], maximise)
    signed = values * np.where([name in maximise for name in "fgh"], -1.0, 1.0)
    ok = (status == 0) & np.all(np.isfinite(values), axis=1)
    better = lambda x, y: np.all(x <= y) and np.any(x < y)
    wanted = {
        tuple(signed[k])
        for k in np.flatnonzero(ok)
        if not any(better(signed[j], signed[k]) for j in np.flatnonzero(ok))
    }
    rows = signed[front["design"].values]
    assert {tuple(row) for row in rows} == wanted and len(rows) == len(wanted)
    assert np.all(np.diff(front["f"].values) >= 0)


def test_a_front_of_a_grid_and_what_it_refuses(tmp_path):
    found = run(None, "grid")
    front = pareto_front(found, ["nested.size", "a"], maximise=["a"])
    assert front["a"].values.tolist() == [1.0, 2.0, 3.0] and np.all(front["b"] == 0.5)
    with pytest.raises(ValueError, match="curve: one number for each design"):
        pareto_front(found, ["curve", "a"])
    with pytest.raises(mbs.UnknownNameError, match="did you mean 'nested.size'"):
        pareto_front(found, ["nested.sise"])
    with pytest.raises(mbs.UnknownNameError, match="objective 'b'"):
        pareto_front(found, ["a"], maximise=["b"])
