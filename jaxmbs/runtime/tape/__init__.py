"""Tapes: traced programs run at once by a small machine in C, without a compiler."""

from ._bytes import read_tape, write_tape
from ._flatten import UnsupportedError
from ._machine import is_available
from ._rows import TapeError
from ._tape import Tape

__all__ = [
    "Tape",
    "TapeError",
    "UnsupportedError",
    "is_available",
    "read_tape",
    "write_tape",
]
