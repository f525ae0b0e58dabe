"""The demo from beginning to end, and the example of the README."""

import csv
import re
import sys
from pathlib import Path

import jax
import numpy as np
import pytest

from jaxmbs import cli
from jaxmbs.demo import _files as files
from jaxmbs.demo import _story as story
from jaxmbs.demo._loads import crank_angle, crank_grid
from jaxmbs.demo._reference import FREE_TOLERANCE, LOADS, TIMES

README = Path(__file__).parents[2] / "README.md"


@pytest.fixture(scope="module")
def results():
    return story.study(size=24, steps=25)


@pytest.fixture
def studied(results, monkeypatch):
    """The command with its results worked out already."""
    monkeypatch.setattr(story, "study", lambda *_: results)
    monkeypatch.setenv("XLA_FLAGS", "")
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "1")


@pytest.mark.long
def test_loads_meet_the_reference(results):
    for name, reference in LOADS.items():
        assert results["deviations"][name] < reference.tolerance, name
    assert results["deviations"]["free run"] < FREE_TOLERANCE


@pytest.mark.long
def test_energy_of_the_free_run_is_kept(results):
    accounts = results["free"].diagnostics
    assert np.max(np.abs(accounts.energy_residual)) < 1e-7 * np.max(accounts.kinetic)


@pytest.mark.long
def test_design_improves_within_its_bounds(results):
    optimum = results["optimum"]
    assert optimum.initial_value == pytest.approx(1.0)
    assert optimum.value < 0.6
    design = np.array(list(optimum.design.values()))
    assert np.all(design >= optimum.lower) and np.all(design <= optimum.upper)
    before, after = (np.asarray(loads.shaking) for loads in results["loads"])
    assert np.mean(after**2) < 0.5 * np.mean(before**2)


@pytest.mark.long
def test_limits_of_the_design_are_kept(results):
    wrist, torque = results["optimum"].limits
    before, after = (np.linalg.norm(loads.wrist, axis=1) for loads in results["loads"])
    assert wrist.ok and torque.ok and (wrist.active or torque.active)
    assert np.max(after) <= np.max(before) * (1 + 1e-6)
    np.testing.assert_allclose(wrist.after, after, rtol=1e-9)
    assert "wrist pin" in results["optimum"].table()


def test_grid_holds_the_reference_times():
    every, even, at_reference = crank_grid(24)
    assert np.all(np.diff(every) > 0) and len(even) == 24
    assert tuple(every[at_reference]) == TIMES
    assert crank_angle(TIMES[-1]) == pytest.approx(0.4 + 50.0 * TIMES[-1])


@pytest.mark.long
def test_command_writes_table_and_plots(studied, tmp_path, capsys):
    folder = tmp_path / "new" / "folder"
    assert cli.main(["demo", "--quick", "--output", str(folder)]) == 0
    assert {path.name for path in folder.iterdir()} == {
        "loads.csv",
        "scene.html",
        "report.html",
        "loads.png",
        "energy.png",
    }
    assert str(folder / "loads.csv") in capsys.readouterr().out
    with (folder / "loads.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["design"] for row in rows] == ["before"] * 24 + ["after"] * 24
    assert float(rows[0]["main_x_N"]) == pytest.approx(LOADS["main"].values[0][0])
    assert float(rows[0]["torque_Nm"]) == pytest.approx(LOADS["torque"].values[0][0])


@pytest.mark.long
def test_without_matplotlib_the_table_is_written(studied, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert cli.main(["demo", "--output", str(tmp_path)]) == 0
    assert {path.name for path in tmp_path.iterdir()} == {"loads.csv", "scene.html", "report.html"}
    assert ".[viz]" in capsys.readouterr().err


@pytest.mark.long
def test_folder_that_cannot_be_written(studied, tmp_path, capsys):
    (tmp_path / "file").write_text("not a folder")
    assert cli.main(["demo", "--output", str(tmp_path / "file")]) == 2
    message = capsys.readouterr().err
    assert "cannot write" in message and str(tmp_path / "file") in message


@pytest.mark.long
def test_refused_folder(studied, tmp_path, capsys, monkeypatch):
    def refuse(dir):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(files.tempfile, "TemporaryFile", refuse)
    assert cli.main(["demo", "--output", str(tmp_path)]) == 2
    assert "Permission denied" in capsys.readouterr().err


@pytest.mark.long
def test_example_of_the_readme_runs(capsys):
    code = re.search(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL).group(1)
    found = {}
    with jax.numpy_dtype_promotion("standard"):
        exec(code, found)
        torque, design, h = found["torque"], found["design"], 1e-3
        right, left = (torque(design | {"stiffness": design["stiffness"] + s}) for s in (h, -h))
    np.testing.assert_allclose(found["gradient"]["stiffness"], (right - left) / (2 * h), rtol=1e-6)
    best = found["best"]
    assert best.value < 0.1 * best.initial_value
    assert f"from {best.initial_value:.1f} to {best.value:.1f} N m" in code  # its last comment
    assert best.table() in capsys.readouterr().out


def test_readme_gives_the_two_lines():
    text = README.read_text(encoding="utf-8")
    start = "python3 -m venv .venv && .venv/bin/pip install -e "
    assert f"{start}'.[viz]' && .venv/bin/python -m jaxmbs demo\n" in text
    assert f"{start}'.[test]' && .venv/bin/python -m pytest\n" in text
