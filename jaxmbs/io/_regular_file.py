"""Read regular files of bounded size; a pipe or device is refused, not waited for."""

import os
import stat
from pathlib import Path

from ..errors import ModelFileError


def read_bytes(path: str | os.PathLike, most: int) -> bytes:
    """Bytes of a file.  Raises: ModelFileError if it cannot be read, is not a regular file, or is too large."""
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
    """Return the path for readers that open it.  Raises: ModelFileError if it exists and is not a regular file."""
    path = Path(path)
    if path.exists() and not path.is_file():
        raise ModelFileError(path, ["it cannot be read: it is no regular file"])
    return path


def _open_without_blocking(path, flags):
    """Open a path without blocking, even a pipe that nobody writes to."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))
