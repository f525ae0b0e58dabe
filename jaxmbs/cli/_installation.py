"""Commands about the installation, and the settings of this process."""

import argparse
import contextlib
import os

# What is asked here is solved once, so that compiling, not computing, is what takes time.
_QUICK_COMPILE = "--xla_backend_optimization_level=0"


def demo(options: argparse.Namespace) -> int:
    """The demo."""
    prepare()
    from ..demo import run
    from ..runtime import SMALL, collector_at_rest

    # its motions are short: programs of fewer equations gain more than they lose in steps
    with SMALL(True), collector_at_rest():
        return run(options.output, quick=options.quick)


def doctor(options: argparse.Namespace) -> int:
    """The report on the installation."""
    from ..doctor import main

    return main()


def prepare() -> None:
    """Double precision and compiler flags for this process; flags count only before the first compilation."""
    import jax

    from .. import doctor
    from ..runtime import _cache as programs

    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    given = os.environ.get("XLA_FLAGS", "")
    flags = [given] if given else []
    if "xla_backend_optimization_level" not in given:
        flags.append(_QUICK_COMPILE)
    # the flag, not the library's marks: these compile a tenth slower, and here compiling takes the time
    if doctor.needs_small_loops_flag(jax.__version__) and doctor.SMALL_LOOPS not in given:
        flags.append(doctor.SMALL_LOOPS_FLAG)
    os.environ["XLA_FLAGS"] = " ".join(flags)
    jax.config.update("jax_enable_x64", True)
    with contextlib.suppress(OSError):  # no folder to write to: every process compiles for itself
        programs.cache()
