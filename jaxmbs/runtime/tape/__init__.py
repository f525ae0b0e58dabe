"""Tapes: traced programs run at once by a small machine, without a compiler."""

from ._bytes import read_tape, write_tape
from ._flatten import UnsupportedError
from ._machine import ASKED, is_available, machine_kind
from ._overtime import OvertimeError, limited
from ._rows import TapeError
from ._tape import Tape

__all__ = [
    "ASKED",
    "OvertimeError",
    "Tape",
    "TapeError",
    "UnsupportedError",
    "is_available",
    "limited",
    "machine_kind",
    "read_tape",
    "write_tape",
]
