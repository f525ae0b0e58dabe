"""Every benchmark runs with --quick and writes well-formed rows; nothing here judges a time."""

import json
import math
import re
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent.parent / "benchmarks"
KEYS = {"case", "metric", "value", "unit", "peer", "peer_value", "ratio"}
PACKAGES = {
    "tiers": (),
    "tree_dynamics": ("pinocchio",),
    "trajectory_gradient": ("mujoco",),
    "energy_drift": ("mujoco", "matplotlib"),
    "closed_loop": (),
    "iftomm": (),
    "optimisers": (),
    "solvers": (),
    "rows_of_loops": (),
    "reactions": (),
    "reliability": (),
    "substructures": (),
    "component_chain": (),
    "elastic_bodies": (),
    "elastic_costs": (),
    "batch_of_motions": ("mujoco",),
    "accelerator": (),
    "cold_start": (),
    "compiler_tricks": (),
    "saved_times": (),
    "fmu_calls": ("fmpy",),
    "diffrax_loops": (),
    "imported_models": ("mujoco", "pinocchio"),
    "wishbone_limits": (),
    "wishbones_side_by_side": (),
    "openmdao_component": ("openmdao",),
    "published_decks": (),
    "validity": (),
    "vehicles": (),
    "identify_arm": ("mujoco", "plotly", "tabulate"),
    "cables": (),
    "contact": (),
    "cycles": (),
    "hydraulic_arm": (),
    "joint_friction": (),
    "kinds": (),
    "long_run_energy": (),
    "notebooks": (),
    "qualification": ("pyyeti", "rainflow"),
    "shock_records": (),
    "states": (),
    "study_store": ("xarray", "zarr"),
}
LONG = (
    "reactions",
    "tiers",
    "tree_dynamics",
    "batch_of_motions",
    "elastic_bodies",
    "closed_loop",
    "trajectory_gradient",
)
LONG += ("vehicles", "validity", "cold_start", "compiler_tricks", "energy_drift")
LONG += ("openmdao_component", "fmu_calls")
LONG += (
    "wishbone_limits",
    "wishbones_side_by_side",
    "imported_models",
    "published_decks",
    "saved_times",
    "substructures",
    "diffrax_loops",
)
LONG += ("cables", "contact", "cycles", "hydraulic_arm", "joint_friction", "kinds", "long_run_energy", "notebooks")
LONG += ("optimisers", "qualification", "reliability", "shock_records", "states", "study_store")
LONG += ("component_chain", "elastic_costs", "rows_of_loops", "accelerator", "iftomm", "solvers", "identify_arm")


def _marked(name):
    return pytest.param(name, marks=pytest.mark.long if name in LONG else pytest.mark.slow)


@pytest.mark.parametrize("name", [_marked(name) for name in PACKAGES])
def test_quick_run_writes_rows(name, tmp_path):
    for package in PACKAGES[name]:
        pytest.importorskip(package)
    file = tmp_path / "rows.json"
    command = [sys.executable, str(FOLDER / f"{name}.py"), "--quick", "--json", str(file)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stderr
    rows = json.loads(file.read_text())
    check_rows(rows)
    if name == "energy_drift":
        assert file.with_suffix(".png").stat().st_size > 0


DECK = """SOL 101
CEND
SPC = 1
LOAD = 2
BEGIN BULK
MAT1,1,2.+11,,.3
PROD,1,1,1.-4
GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.,,23456
CROD,1,1,1,2
SPC1,1,123456,1
FORCE,2,2,,200.,1.,0.,0.
ENDDATA
"""
F06 = """1  SUBCASE 1
                   D I S P L A C E M E N T   V E C T O R
      POINT ID.   TYPE          T1             T2             T3             R1             R2             R3
             2      G      1.000000E-05   0.0            0.0            0.0            0.0            0.0
"""


@pytest.mark.long
def test_a_folder_of_decks_is_read_to_its_end(tmp_path):
    """One deck beside its f06, one that is refused; a second run takes both from the file of finished ones."""
    decks = tmp_path / "decks"
    decks.mkdir()
    (decks / "rod.bdf").write_text(DECK)
    (decks / "rod.f06").write_text(F06)
    (decks / "gap.bdf").write_text(DECK.replace("CROD,1", "CGAP,2,1,1,2\nCROD,1"))
    file, keep = tmp_path / "rows.json", tmp_path / "keep"
    command = [sys.executable, str(FOLDER / "published_decks.py"), "--folder", str(decks)]
    for _ in range(2):
        done = subprocess.run([*command, "--keep", keep, "--json", file], capture_output=True, text=True, timeout=900)
        assert done.returncode == 0, done.stderr
        rows = json.loads(file.read_text())
        check_rows(rows)
        found = {row["case"]: row["value"] for row in rows}
        assert (found["decks read"], found["decks refused"], found["decks failed"]) == (1, 1, 0)
        assert found["refused for CGAP"] == 1 and found["rod.bdf, .f06, displacements of subcase 1"] < 1e-12
        assert len(keep.read_text().splitlines()) == 2


@pytest.mark.long
def test_tasks_for_mosaic_are_the_complex_step(tmp_path):
    for package in ("tesseract_core", "fastapi", "uvicorn", "lz4", "fsspec"):
        pytest.importorskip(package)
    file = tmp_path / "rows.json"
    command = [sys.executable, str(FOLDER / "mosaic" / "multibody.py"), "--quick", "--json", str(file)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stderr
    rows = json.loads(file.read_text())
    check_rows(rows)
    errors = [row["value"] for row in rows if row["metric"] in ("error of the value", "error of the VJP")]
    assert len(errors) == 2 and max(errors) < 1e-8


def check_rows(rows):
    assert isinstance(rows, list)
    versions = [row for row in rows if row["metric"] == "version"]
    assert {"machine", "jax", "jaxmbs"} <= {row["case"] for row in versions}
    assert len(rows) > len(versions)
    for row in rows:
        assert set(row) == KEYS
        assert all(isinstance(row[key], str) for key in ("case", "metric", "unit"))
        if row["metric"] == "version":
            continue
        assert isinstance(row["value"], int | float) and math.isfinite(row["value"])
        if row["peer_value"] is not None:
            assert isinstance(row["peer"], str)
            assert row["ratio"] == pytest.approx(row["value"] / row["peer_value"])


def test_every_benchmark_is_run_here_and_by_run():
    text = (FOLDER / "run.py").read_text(encoding="utf-8")
    texts = {path.stem: path.read_text(encoding="utf-8") for path in FOLDER.glob("*.py") if path.stem != "common"}
    writing = {name for name, program in texts.items() if re.search(r"\b(parser|run_cases)\(__doc__", program)}
    assert writing == set(PACKAGES) == set(re.findall(r'^    "(\w+)",$', text, re.MULTILINE))


def test_every_file_has_a_line_in_the_index():
    found = re.findall(r"^\| `(\w+\.py)` \|", (FOLDER / "README.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(found) == sorted(path.name for path in FOLDER.glob("*.py"))


_FIGURES = r"^\|[^|]+\| ([\d.e-]+) [^|]+\|(?:[^|]*: ([\d.e-]+) [^|]+| )\| `python benchmarks/(\w+)\.py` \|$"


def test_figures_of_the_readme_are_those_of_the_results():
    """The figures of every row are those of one row of the JSON file of its command, to three digits."""
    text = (FOLDER.parent / "README.md").read_text(encoding="utf-8")
    rows = re.findall(_FIGURES, text, re.MULTILINE)
    assert len(rows) == text.count("| `python benchmarks/") >= 8
    for value, peer, name in rows:
        results = json.loads((FOLDER / "results" / f"{name}.json").read_text(encoding="utf-8"))
        figures = [(row["value"], row["peer_value"]) for row in results if isinstance(row["value"], float)]
        pairs = {(f"{ours:.3g}", f"{theirs:.3g}" if peer else "") for ours, theirs in figures if theirs or not peer}
        assert (value, peer) in pairs, f"README.md: {value} beside {peer or 'nothing'}, {name}.json has other figures"
