"""Tapes: traced programs run at once by a small machine in C, without a compiler."""

from ._flatten import UnsupportedError
from ._machine import is_available
from ._tape import Tape

__all__ = [
    "Tape",
    "UnsupportedError",
    "is_available",
]
