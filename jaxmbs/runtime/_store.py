"""The store: what was made once, in files of a folder, each under the name of its content.

Whatever is wrong with the folder (it cannot be made, is full, read-only or open to other users) the library goes on
without; a file that is damaged is not used, and goes.  Files are replaced as a whole, so several processes may write
at once: what they write under one name is the same.
"""

import contextlib
import functools
import hashlib
import os
import tempfile
import zlib
from pathlib import Path

from . import _tuning as tuning
from ._cache import user_folder

_MAGIC = b"jaxmbs program 1\n"
_HEAD = len(_MAGIC) + hashlib.sha256().digest_size
_LOOK_EVERY = 100  # files written, at the size of all


class Store:
    """Contents by key in a folder of this user's alone.

    Args: size: of all files [bytes]; those not used for longest go.
    """

    def __init__(self, folder: Path | None, size: int = 256 * 2**20):
        self._folder, self._size, self._written = _own_folder(folder), size, 0

    @property
    def folder(self) -> Path | None:
        """The folder of its files; None if it keeps none."""
        return self._folder

    def read(self, key: str) -> bytes | None:
        """Content under a key; None if there is none that is whole."""
        if self._folder is None:
            return None
        try:
            file = (self._folder / key).read_bytes()
        except OSError:
            return None
        with contextlib.suppress(OSError):
            os.utime(self._folder / key)  # used now
        found = _unpacked(key, file)
        if found is None:
            self.remove(key)
        return found

    def write(self, key: str, content: bytes) -> None:
        """Store a content under a key, as a whole or not at all."""
        if self._folder is None or len(content) > tuning.STORED_BYTES:
            return
        try:
            _replace(self._folder / key, _packed(key, content))
            if self._written % _LOOK_EVERY == 0:
                _shrink(self._folder, self._size)
            self._written += 1
        except OSError:
            self._folder = None  # full, gone or read-only: this process goes on without

    def remove(self, key: str) -> None:
        """Forget a content."""
        if self._folder is not None:
            with contextlib.suppress(OSError):
                (self._folder / key).unlink()


@functools.cache
def store() -> Store:
    """The store of this process: in the folder that the environment variable JAXMBS_STORE names, none where it says
    "off", else in the user's folder for caches."""
    setting = os.environ.get("JAXMBS_STORE", "")
    if setting == "off":
        return Store(None)
    try:
        return Store(Path(setting).expanduser() if setting else user_folder() / "jaxmbs" / "programs")
    except RuntimeError:  # no home
        return Store(None)


def _own_folder(folder):
    """The folder, made if need be; None if it cannot be, or if others can write to it."""
    if folder is None:
        return None
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        about = folder.stat()
    except OSError:
        return None
    is_open = hasattr(os, "getuid") and (about.st_uid != os.getuid() or about.st_mode & 0o022)
    return None if is_open else folder


def _packed(key, content):
    packed = zlib.compress(content, 1)
    return _MAGIC + hashlib.sha256(key.encode() + packed).digest() + packed


def _unpacked(key, file):
    """The content of a file; None if it is not the one that was written under this key."""
    packed = file[_HEAD:]
    if file[:_HEAD] != _MAGIC + hashlib.sha256(key.encode() + packed).digest():
        return None
    reader = zlib.decompressobj()
    try:
        found = reader.decompress(packed, tuning.STORED_BYTES)
    except zlib.error:
        return None
    return found if reader.eof else None


def _replace(path, content):
    handle, part = tempfile.mkstemp(prefix=".", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.replace(part, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(part)
        raise


def _shrink(folder, size):
    """Delete what was not used for longest; another process may do so at the same time."""
    files = []
    for file in os.scandir(folder):
        with contextlib.suppress(OSError):
            files.append((file.stat().st_mtime, file.stat().st_size, file.path))
    kept = 0
    for _, bytes_of_file, path in sorted(files, reverse=True):
        kept += bytes_of_file
        if kept > size:
            with contextlib.suppress(OSError):
                os.unlink(path)
