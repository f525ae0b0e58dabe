"""The machine in C, built when the library is installed, and the one in NumPy where it was not."""

import ctypes
import functools
import os
from collections.abc import Callable

import numpy as np

from ._build import LIBRARY, sources_number
from ._flatten import LONG_INTEGERS, UnsupportedError
from ._host import call_host
from ._parts import Parts

_HOST = ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_void_p)


def _machine_setting(setting: str) -> str:
    if setting not in ("auto", "c", "numpy"):
        raise ValueError(f"JAXMBS_TAPE={setting!r} must be auto, c or numpy")
    return setting


#: The machine that the environment asks for.
ASKED = _machine_setting(os.environ.get("JAXMBS_TAPE", "auto"))


@functools.cache
def _machine() -> ctypes.CDLL | None:
    """The machine in C, or None where it was not built or from other sources."""
    try:
        library = ctypes.CDLL(str(LIBRARY))
        library.tape_sources.restype = ctypes.c_int64
    except (OSError, AttributeError):
        return None
    return library if library.tape_sources() == sources_number() else None


def machine_kind() -> str | None:
    """ "c" or "numpy", whichever runs tapes; None where the one that `JAXMBS_TAPE` asks for is missing."""
    if ASKED == "numpy" or _machine() is None:
        return None if ASKED == "c" else "numpy"
    return "c"


def is_available() -> bool:
    """True if a machine runs tapes here."""
    return machine_kind() is not None


def bind(parts: Parts, arena: np.ndarray) -> Callable[[], None]:
    """A function that runs a tape over an arena, which it changes."""
    if machine_kind() == "numpy":
        from ._numpy_machine import NumpyRun

        return NumpyRun(parts, arena)
    return functools.partial(_run, parts, arena)


def _run(parts, arena):
    """Python's lock is free meanwhile, but for the instructions that the machine leaves to NumPy."""
    failed: list[BaseException] = []

    def call(number, _):
        try:
            if number < 0:  # once is enough
                failed or failed.append(UnsupportedError(LONG_INTEGERS))
                return
            call_host(parts.code[number], parts.tables, arena)
        except BaseException as error:  # ctypes prints what a callback raises, and goes on
            failed.append(error)

    pointers = [array.ctypes.data_as(ctypes.c_void_p) for array in (parts.code, parts.starts, parts.tables, arena)]
    library = _machine()
    assert library is not None
    library.tape_run(*pointers, _HOST(call))
    if failed:
        raise failed[0]
