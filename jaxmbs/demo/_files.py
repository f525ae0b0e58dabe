"""Files of the demo: a table of the loads before and after, a scene, and plots if matplotlib is installed."""

import csv
import sys
import tempfile
from pathlib import Path

import numpy as np

from ..atomic_write import atomic_file
from ..documents import report
from ..viz import scene
from ._loads import QUANTITIES, crank_angle
from ._pictures import draw

_PLAYED = ("systems", "motions", "reactions")


def open_folder(output) -> Path:
    """The folder, made when missing.  Raises: OSError when it cannot be written."""
    folder = Path(output)
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder):
        return folder


def write(folder: Path, results: dict) -> list[Path]:
    """Write everything; returns the files.  Without matplotlib there are no plots, and a line says so."""
    written = [_loads_table(folder / "loads.csv", results["loads"]), _scene(folder / "scene.html", results)]
    written.append(_report(folder / "report.html", results))
    try:
        return written + draw(folder, results)
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "matplotlib":
            raise
        print("demo: no plots, matplotlib is missing: pip install -e '.[viz]'", file=sys.stderr)
        return written


def _scene(path: Path, results) -> Path:
    """Both designs side by side with the loads of their joints, for a browser."""
    names = ("before", "after")
    systems, motions, reactions = (dict(zip(names, results[key], strict=True)) for key in _PLAYED)
    scene(systems, motions, path, loads=reactions, traces=["rod_tail"], title="Slider-crank before and after")
    return path


def _report(path: Path, results) -> Path:
    """The improved design with its motion, loads and what the search did."""
    (_, system), (_, motion), (_, loads) = (results[key] for key in _PLAYED)
    parts = {"motion": motion, "reactions": loads, "optimum": results["optimum"], "free_run": results["free"]}
    return report(path, system, title="Slider-crank after optimisation", **parts)


def _loads_table(path: Path, pair) -> Path:
    """Loads over one turn, a row per design and crank angle."""
    axes = {1: ("",), 2: ("_x", "_y")}
    head = ["design", "time_s", "crank_angle_rad"]
    for name in QUANTITIES:
        unit = "Nm" if name == "torque" else "N"
        head += [f"{name}{axis}_{unit}" for axis in axes[getattr(pair[0], name).shape[1]]]
    with atomic_file(path, newline="") as file:
        table = csv.writer(file)
        table.writerow(head)
        for design, loads in zip(("before", "after"), pair, strict=True):
            columns = [loads.t, crank_angle(loads.t), *(getattr(loads, name) for name in QUANTITIES)]
            rows = np.column_stack([np.asarray(column) for column in columns])
            table.writerows([design, *(f"{value:.9g}" for value in row)] for row in rows)
    return path
