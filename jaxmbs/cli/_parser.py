"""Parser of the command line; commands import their modules when they run."""

import argparse
import importlib
from pathlib import Path

from .. import __version__
from ..io._numbers import real

_TABLES, _PICTURES = (".csv", ".nc"), (".png", ".svg", ".pdf", ".html")
_MODEL = "a .urdf, an .xml of MuJoCo or a .json of jaxmbs"


def parser() -> argparse.ArgumentParser:
    """Parser of the whole command line; `options.run(options)` runs the command."""
    whole = argparse.ArgumentParser(prog="python -m jaxmbs", description="Differentiable multibody dynamics in JAX.")
    whole.add_argument("--version", action="version", version=f"jaxmbs {__version__}")
    commands = whole.add_subparsers(metavar="command", required=True)

    check = _command(commands, "check", "every fault, mobility, redundancy, and what was left out of a file")
    check.set_defaults(run=_run("analyses", "check"))

    simulate = _command(commands, "simulate", "the motion from a pose, as a table or a file")
    _pose(simulate)
    simulate.add_argument("--t1", type=float, required=True, metavar="SECONDS", help="end of the motion")
    simulate.add_argument("--steps", type=_count, default=100, metavar="N", help="times saved (default: %(default)s)")
    simulate.add_argument("--stiff", action="store_true", help="an implicit solver, for stiff springs and stops")
    _out(simulate, "table of the motion, .csv or .nc (default: a summary is printed)", _TABLES)
    simulate.set_defaults(run=_run("analyses", "simulate"))

    reactions = _command(commands, "reactions", "what every joint carries in a pose")
    _pose(reactions)
    _out(reactions, "table, .csv or .nc (default: it is printed)", _TABLES)
    reactions.set_defaults(run=_run("analyses", "reactions"))

    modes = _command(commands, "modes", "frequencies and damping about the equilibrium near a pose")
    _pose(modes)
    modes.add_argument("--here", action="store_true", help="about the pose itself, at rest there or not")
    _out(modes, "table, .csv (default: it is printed)", _TABLES[:1])
    modes.set_defaults(run=_run("analyses", "modes"))

    report = _command(
        commands, "report", "one HTML file: the machine, its loads in a pose, its motion, validity, versions"
    )
    _pose(report)
    report.add_argument("--t1", type=float, metavar="SECONDS", help="end of a motion from the pose (default: none)")
    report.add_argument("--steps", type=_count, default=100, metavar="N", help="times of it (default: %(default)s)")
    report.add_argument("--title", default="", help="of the page (default: the name of the file)")
    _out(report, "the page, .html", (".html",), required=True)
    report.set_defaults(run=_run("files", "report"))

    view = _command(commands, "view", "a picture of a pose, or a scene to turn round")
    _pose(view)
    _out(view, "picture (.png, .svg, .pdf) or scene (.html)", _PICTURES, required=True)
    view.add_argument(
        "--plane", default="xz", help="of a picture: two world axes, right and up (default: %(default)s)"
    )
    view.set_defaults(run=_run("files", "view"))

    convert = _command(commands, "convert", "a model as a file of jaxmbs")
    convert.add_argument("output", metavar="OUTPUT", type=_ending((".json",)), help="the file to write, .json")
    convert.set_defaults(run=_run("files", "convert"))

    tesseract = commands.add_parser("tesseract", help="a stored question as the folder of a Tesseract's container")
    tesseract.add_argument("question", metavar="QUESTION", help="a file that jaxmbs.runtime.export stored")
    tesseract.add_argument("output", metavar="FOLDER", help="the folder to make")
    tesseract.add_argument("--name", metavar="NAME", help="of the Tesseract (default: that of the stored function)")
    tesseract.set_defaults(run=_run("files", "tesseract"))

    demo = commands.add_parser("demo", help="simulate a slider-crank, check its joint loads, improve its design")
    demo.add_argument("--output", default="jaxmbs-demo", help="folder for plots and tables (default: %(default)s)")
    demo.add_argument("--quick", action="store_true", help="fewer crank angles and steps")
    demo.set_defaults(run=_run("installation", "demo"))
    doctor = commands.add_parser("doctor", help="print versions, devices, precision and known-bad releases")
    doctor.set_defaults(run=_run("installation", "doctor"))
    return whole


def _run(module, name):
    def run(options):
        return getattr(importlib.import_module(f"._{module}", __package__), name)(options)

    return run


def _command(commands, name, about):
    """A command on a model, with what can be said of reading it."""
    made = commands.add_parser(name, help=about, description=f"{about[0].upper()}{about[1:]}.")
    made.add_argument("model", metavar="MODEL", help=_MODEL)
    made.add_argument("--free", action="store_true", help="URDF: the root link floats")
    made.add_argument("--welds", action="store_true", help="keep bodies on fixed joints as bodies")
    made.add_argument("--stops", type=float, metavar="K", help="limits of joints as bump stops of this stiffness")
    made.add_argument("--drop-tendons", action="store_true", help="MJCF: leave tendons out")
    return made


def _pose(command):
    for words, dest, about in (
        (("--set", "-s"), "values", "a joint's coordinate [m, rad], of several numbers with commas between"),
        (("--velocity", "-v"), "velocities", "a joint's velocity [m/s, rad/s], likewise"),
    ):
        options = {"dest": dest, "metavar": "JOINT=VALUE", "type": _assignment, "help": f"{about}; may be repeated"}
        command.add_argument(*words, action="append", default=[], **options)


def _out(command, about, endings, required=False):
    command.add_argument("--out", "-o", metavar="FILE", type=_ending(endings), help=about, required=required)


def _ending(endings):
    def path(text):
        if Path(text).suffix.lower() not in endings:
            raise argparse.ArgumentTypeError(f"{text!r} does not end in {' or '.join(endings)}")
        return text

    return path


def _assignment(text):
    name, sign, numbers = text.partition("=")
    try:
        values = [real(word) for word in numbers.split(",")]
    except ValueError:
        values = []
    if not (name and sign and values):
        raise argparse.ArgumentTypeError(f"{text!r} is not JOINT=NUMBER")
    return name, values[0] if len(values) == 1 else values


def _count(text):
    if not (text.isdecimal() and int(text) > 0):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of times")
    return int(text)
