"""Atomic writes: a file is replaced as a whole or not at all."""

import contextlib
import os
import signal
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any


@contextlib.contextmanager
def atomic_path(path: str | os.PathLike) -> Iterator[Path]:
    """Temporary path beside `path` to write to; once all of it is on the disk, it replaces `path`.

    If writing fails, by an interrupt or SIGTERM too, the temporary file is deleted and `path` is unchanged.  A link
    is
    followed: the file that it points to is replaced.  A pipe or device (/dev/null) is written to directly.
    """
    path = Path(os.path.realpath(path))
    if path.exists() and not path.is_file():
        yield path
        return
    with _sigterm_as_error():
        part = _temporary_file(path)
        try:
            yield part
            mode = path.stat().st_mode if path.exists() else 0o666 & ~_umask()
            part.chmod(mode & 0o777)
            _sync(part, os.O_RDWR)
            os.replace(part, path)
        except BaseException:
            part.unlink(missing_ok=True)
            raise
        with contextlib.suppress(OSError):  # the name of the file; some systems open no folders
            _sync(path.parent, os.O_RDONLY)


@contextlib.contextmanager
def atomic_file(path: str | os.PathLike, newline: str | None = None) -> Iterator[Any]:
    """Text file that replaces `path` once all of it is written."""
    with atomic_path(path) as part, open(part, "w", encoding="utf-8", newline=newline) as file:
        yield file


def write_atomic(path: str | os.PathLike, content: str | bytes) -> None:
    """Write the content to `path`, as a whole or not at all."""
    with atomic_path(path) as part:
        part.write_bytes(content.encode() if isinstance(content, str) else content)


def _temporary_file(path: Path) -> Path:
    """Create an empty temporary file in the folder of `path`."""
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.stem[:40]}-", suffix=path.suffix, dir=path.parent)
    except OSError as error:
        raise type(error)(error.errno, error.strerror, str(path)) from None  # the name that the user knows
    os.close(handle)
    return Path(name)


def _sync(path: Path, flags: int) -> None:
    """Wait until the written data is on the disk (fsync)."""
    handle = os.open(path, flags)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextlib.contextmanager
def _sigterm_as_error() -> Iterator[None]:
    """Context in which SIGTERM raises SystemExit, so that temporary files are deleted; user handlers stay."""
    main = threading.current_thread() is threading.main_thread()
    if not main or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield
        return

    def end(number: int, frame: Any) -> None:
        raise SystemExit(128 + number)

    signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _umask() -> int:
    """The umask of this process; the system only returns it when it is set."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
