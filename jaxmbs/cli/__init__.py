"""The command line: `python -m jaxmbs --help`.

Results go to the standard output, all that is said about them to the error stream.  Exit statuses: 0, 1 for a fault
of the model or of a file, 2 for a command that cannot be understood, 130 after an interrupt, 141 when the reader of
the output has gone.
"""

import contextlib
import os
import sys

from . import _interrupts as interrupts
from ._parser import parser
from ._terminal import print_note

__all__ = [
    "main",
    "run_process",
]

FAULT, INTERRUPTED, NO_READER = 1, 130, 141


def main(argv: list[str] | None = None) -> int:
    """Run one command; returns the exit status."""
    options = parser().parse_args(argv)
    try:
        with interrupts.interrupts_remembered():
            status = options.run(options)
            sys.stdout.flush()
        return status
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # Python's own flush at the end is quiet too
        return NO_READER
    except (ValueError, TypeError, RuntimeError, OSError, ImportError) as error:
        print_note(f"error: {_error_text(error)}")
        return FAULT


def run_process() -> None:
    """The command of this process, which ends with its exit status."""
    status = main()
    if status == INTERRUPTED:
        # At once: XLA goes on compiling what was interrupted, and crashes when Python takes its client away.
        with contextlib.suppress(OSError):
            sys.stdout.flush()
        os._exit(status)
    sys.exit(status)


def _error_text(error) -> str:
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    if isinstance(error, ModuleNotFoundError):
        return f"{error.name} is not installed: pip install 'jaxmbs[io,viz,studies]'"
    return str(error) or type(error).__name__
