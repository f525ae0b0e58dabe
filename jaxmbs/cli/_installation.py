"""Commands about the installation, and the settings of this process."""

import argparse
import contextlib
import os


def demo(options: argparse.Namespace) -> int:
    """The demo."""
    prepare()
    from ..demo import run
    from ..runtime import SMALL_PROGRAM, garbage_collection_paused

    # its motions are short: programs of fewer equations gain more than they lose in steps
    with SMALL_PROGRAM(True), garbage_collection_paused():
        return run(options.output, quick=options.quick)


def doctor(options: argparse.Namespace) -> int:
    """The report on the installation."""
    from ..doctor import main

    return main()


def prepare() -> None:
    """Double precision and compiler flags for this process; flags count only before the first compilation."""
    import jax

    from ..runtime import cache, set_quick_flags

    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    set_quick_flags()  # each question is asked once, so that compiling, not computing, takes the time
    jax.config.update("jax_enable_x64", True)
    with contextlib.suppress(OSError):  # no folder to write to: every process compiles for itself
        cache()
