"""The machine in C, built when the library is installed."""

import ctypes
import functools
from collections.abc import Callable

import numpy as np

from ._build import LIBRARY, sources_number

_HOST = ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_void_p)


@functools.cache
def machine() -> ctypes.CDLL | None:
    """The machine, or None where it was not built or from other sources."""
    try:
        library = ctypes.CDLL(str(LIBRARY))
        library.tape_sources.restype = ctypes.c_int64
    except (OSError, AttributeError):
        return None
    return library if library.tape_sources() == sources_number() else None


def is_available() -> bool:
    """True if this installation has the machine."""
    return machine() is not None


def run(
    code: np.ndarray, starts: np.ndarray, tables: np.ndarray, arena: np.ndarray, host: Callable[[int], None]
) -> None:
    """Run a tape over an arena, which it changes; Python's lock is free meanwhile.

    Args: host: called for instructions that the machine leaves to NumPy, by their number.
    """
    failed: list[BaseException] = []

    def call(number, _):
        try:
            host(number)
        except BaseException as error:  # ctypes prints what a callback raises, and goes on
            failed.append(error)

    pointers = [array.ctypes.data_as(ctypes.c_void_p) for array in (code, starts, tables, arena)]
    library = machine()
    assert library is not None  # a tape is made where there is one
    library.tape_run(*pointers, _HOST(call))
    if failed:
        raise failed[0]
