"""Tapes: traced programs run at once by a small machine, without a compiler."""

from ._bytes import read_tape, write_tape
from ._flatten import Limits, TooLargeError, UnsupportedError
from ._machine import ASKED, is_available, machine_kind
from ._overtime import OvertimeError, time_limit
from ._rows import TapeError
from ._tape import SHOWN, WATCH, Tape


def missing_primitives() -> list[str]:
    """Names of the primitives of `jax.lax` that tapes do not have; XLA compiles programs with one of them."""
    from ._coverage import missing_primitives  # which needs all rules

    return missing_primitives()


__all__ = [
    "ASKED",
    "SHOWN",
    "WATCH",
    "Limits",
    "OvertimeError",
    "Tape",
    "TapeError",
    "TooLargeError",
    "UnsupportedError",
    "is_available",
    "time_limit",
    "machine_kind",
    "missing_primitives",
    "read_tape",
    "write_tape",
]
