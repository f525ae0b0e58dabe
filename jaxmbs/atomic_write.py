"""Files that are there as a whole or not at all."""

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
    """A path beside `path` to write to; once all of it is on the disk it takes the place of `path`.

    If something fails, an interrupt and SIGTERM included, it goes, and what was at `path` stays.  A link is followed:
    the file that it points to is replaced.  What is no file (a pipe, /dev/null) is written to as it is.
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
    """A text file that is at `path` once all of it is written."""
    with atomic_path(path) as part, open(part, "w", encoding="utf-8", newline=newline) as file:
        yield file


def write_atomic(path: str | os.PathLike, content: str | bytes) -> None:
    """The content as the file at `path`, as a whole or not at all."""
    with atomic_path(path) as part:
        part.write_bytes(content.encode() if isinstance(content, str) else content)


def _temporary_file(path: Path) -> Path:
    """A new empty file in the folder of `path`."""
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.stem[:40]}-", suffix=path.suffix, dir=path.parent)
    except OSError as error:
        raise type(error)(error.errno, error.strerror, str(path)) from None  # the name that the user knows
    os.close(handle)
    return Path(name)


def _sync(path: Path, flags: int) -> None:
    """Wait until the disk has what was written."""
    handle = os.open(path, flags)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextlib.contextmanager
def _sigterm_as_error() -> Iterator[None]:
    """Inside, SIGTERM ends the program by an exception, so that what was begun is cleared away, unless the user has a
    handler of their own."""
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
    """What permissions this process takes from new files; it can only be read by setting it."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
