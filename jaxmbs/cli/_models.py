"""Models named on the command line, and poses of them."""

import argparse
import warnings
from pathlib import Path

from ..assembly._state import State
from ..builder import SystemBuilder
from ..errors import ModelFileError
from ..io import Imported, load_model, read_mjcf, read_sdf, read_urdf
from ..model._system import System
from ._installation import prepare
from ._terminal import print_note


def read(options: argparse.Namespace) -> Imported:
    """The model, by the ending of its name."""
    prepare()
    path = Path(options.model)
    fixed = "welds" if options.welds else "frames"
    ending = path.suffix.lower()
    if ending == ".urdf":
        return read_urdf(path, base="free" if options.free else "fixed", fixed=fixed, stops=options.stops)
    if ending == ".sdf":
        return read_sdf(path, base="free" if options.free else "fixed", fixed=fixed, stops=options.stops)
    if ending in (".xml", ".mjcf"):
        tendons = "drop" if options.drop_tendons else "read"
        return read_mjcf(path, fixed=fixed, stops=options.stops, tendons=tendons)
    if ending != ".json":
        raise ModelFileError(
            path, [f"a model is a .urdf, .sdf, .xml or .json, not {ending or 'a name without ending'!r}"]
        )
    builder = load_model(path)
    if not isinstance(builder, SystemBuilder):
        raise ModelFileError(path, [f"it holds a {type(builder).__name__}, not a mechanism"])
    return Imported(builder)


def read_state(options: argparse.Namespace) -> tuple[System, State]:
    """The system and the state asked for; what was left out of the file is said."""
    model = read(options)
    for sentence in model.remarks:
        print_note(sentence)
    system = build_imported(model)
    guess = {name: value for name, value in model.start.items() if name in system.topology.joint_index}
    return system, _with_short_warnings(
        lambda: State.at(system, dict(options.values), dict(options.velocities), guess)
    )


def build_imported(model: Imported) -> System:
    """The system; warnings in one line each."""
    return _with_short_warnings(model.builder.build)


def _with_short_warnings(call):
    """Result of a call; its warnings are printed in one line each."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        found = call()
    for warning in said:
        print_note(f"warning: {warning.message}")
    return found
