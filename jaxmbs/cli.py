"""The command line: `python -m jaxmbs demo` and `python -m jaxmbs doctor`."""

import argparse
import contextlib
import importlib.metadata
import os

# The demo solves small problems once, so that compiling, not computing, is what takes time in it.
_QUICK_COMPILE = "--xla_backend_optimization_level=0"


def main(argv: list[str] | None = None) -> int:
    """Run one command; returns the exit status: 0, or 2 when an output folder cannot be written."""
    options = _parser().parse_args(argv)
    return options.run(options)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m jaxmbs", description="Differentiable multibody dynamics in JAX.")
    version = f"jaxmbs {importlib.metadata.version('jaxmbs')}"
    parser.add_argument("--version", action="version", version=version)
    commands = parser.add_subparsers(metavar="command", required=True)
    demo = commands.add_parser("demo", help="simulate a slider-crank, check its joint loads, improve its design")
    demo.add_argument("--output", default="jaxmbs-demo", help="folder for plots and tables (default: %(default)s)")
    demo.add_argument("--quick", action="store_true", help="fewer crank angles and steps")
    demo.set_defaults(run=_demo)
    doctor = commands.add_parser("doctor", help="print versions, devices, precision and known-bad releases")
    doctor.set_defaults(run=_doctor)
    return parser


def _demo(options: argparse.Namespace) -> int:
    _prepare()
    from .demo import run

    return run(options.output, quick=options.quick)


def _doctor(options: argparse.Namespace) -> int:
    from . import doctor

    return doctor.main()


def _prepare() -> None:
    """Double precision and compiler flags for this process; flags count only before the first compilation."""
    import jax

    from . import doctor, programs

    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    given = os.environ.get("XLA_FLAGS", "")
    flags = [given] if given else []
    if "xla_backend_optimization_level" not in given:
        flags.append(_QUICK_COMPILE)
    if doctor.needs_small_loops_flag(jax.__version__) and doctor.SMALL_LOOPS not in given:
        flags.append(doctor.SMALL_LOOPS_FLAG)
    os.environ["XLA_FLAGS"] = " ".join(flags)
    jax.config.update("jax_enable_x64", True)
    with contextlib.suppress(OSError):  # no folder to write to: every process compiles for itself
        programs.cache()
