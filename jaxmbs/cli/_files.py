"""Commands that write files, each as a whole or not at all."""

import argparse
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from .. import documents, verbs, viz
from ..atomic_write import atomic_path
from ..io.model_file import save_model
from . import _interrupts as interrupts
from ._models import read, read_state
from ._terminal import print_result


def view(options: argparse.Namespace) -> int:
    """A picture of a pose by matplotlib, or a scene."""
    system, state = read_state(options)
    with _output_path(options.out) as part:
        if Path(options.out).suffix.lower() == ".html":
            viz.scene(system, state, path=part)
            return 0
        import matplotlib

        matplotlib.use("Agg")
        viz.plot_mechanism(system, state, plane=options.plane).figure.savefig(part, dpi=200)
    return 0


def report(options: argparse.Namespace) -> int:
    """The machine with its loads in a pose and, up to `--t1`, its motion and loads, as one page."""
    system, state = read_state(options)
    results: dict[str, Any] = {}
    if options.t1 is not None:
        ts = np.linspace(float(state.t), options.t1, options.steps + 1)
        results["motion"] = verbs.simulate(system, state, ts=ts, progress=sys.stderr.isatty(), throw=False)
    results["reactions"] = verbs.reactions(system, results.get("motion", state))
    with _output_path(options.out) as part:
        documents.report(part, system, title=options.title or Path(options.out).stem, state=state, **results)
    return 0


def convert(options: argparse.Namespace) -> int:
    """A model as one of our files."""
    with _output_path(options.output) as part:
        save_model(read(options).builder, part)
    return 0


def tesseract(options: argparse.Namespace) -> int:
    """A stored question as the folder of a Tesseract."""
    from ..adapters.tesseract import write_tesseract

    folder = write_tesseract(options.question, options.output, options.name)
    print_result(f"{folder}: `tesseract build {folder}` makes the container")
    return 0


def write_table(result: Any, path: str) -> None:
    """A motion, reactions or modes as .csv (`to_pandas`) or .nc (`to_xarray`)."""
    with _output_path(path) as part:
        if Path(path).suffix.lower() == ".csv":
            result.to_pandas().to_csv(part)
        else:
            result.to_xarray().to_netcdf(part, engine="h5netcdf")


@contextmanager
def _output_path(path):
    """A path to write to, which becomes `path` at the end unless an interrupt was asked for."""
    with atomic_path(path) as part:
        yield part
        interrupts.raise_dropped()
