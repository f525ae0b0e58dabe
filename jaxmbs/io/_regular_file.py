"""Files as bytes: regular ones of a bounded size, so that no pipe is waited for."""

import os
import stat
from pathlib import Path

from ..errors import ModelFileError


def read_bytes(path: str | os.PathLike, most: int) -> bytes:
    """A file's bytes.  Raises: ModelFileError where it is not to be read, no regular file, or too large."""
    try:
        with open(path, "rb", opener=_open_without_blocking) as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise ModelFileError(path, ["it cannot be read: it is no regular file"])
            found = file.read(most + 1)
    except (OSError, ValueError) as error:  # ValueError: a null in the name
        if isinstance(error, ModelFileError):
            raise
        raise ModelFileError(path, [f"it cannot be read: {getattr(error, 'strerror', None) or error}"]) from error
    if len(found) > most:
        raise ModelFileError(path, [f"it has more than {most // 1_000_000} megabytes"])
    return found


def require_file(path: str | os.PathLike) -> Path:
    """The path, for readers that open it.  Raises: ModelFileError for what is there but no regular file."""
    path = Path(path)
    if path.exists() and not path.is_file():
        raise ModelFileError(path, ["it cannot be read: it is no regular file"])
    return path


def _open_without_blocking(path, flags):
    """Open a pipe at once, whether or not somebody writes to it."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))
