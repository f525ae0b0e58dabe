"""Files that are there as a whole or not at all."""

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any


@contextlib.contextmanager
def whole_path(path: str | os.PathLike) -> Iterator[Path]:
    """A path beside `path` to write to; what was written takes its place at the end, and goes if something fails."""
    path = Path(path)
    handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    part = Path(name)
    try:
        yield part
        mode = path.stat().st_mode if path.exists() else 0o666 & ~_mask()
        part.chmod(mode & 0o777)
        os.replace(part, path)
    except BaseException:  # an interrupt leaves no half file either
        part.unlink(missing_ok=True)
        raise


@contextlib.contextmanager
def whole_file(path: str | os.PathLike) -> Iterator[Any]:
    """A text file that is at `path` once all of it is written."""
    with whole_path(path) as part, open(part, "w", encoding="utf-8") as file:
        yield file
        file.flush()
        os.fsync(file.fileno())


def _mask() -> int:
    """What permissions this process takes from new files; it can only be read by setting it."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
