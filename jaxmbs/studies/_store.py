"""Store of a study: its description `study.json`, and one file for every finished chunk of designs.

A chunk file is written beside its place, brought onto the disk and then renamed; it carries the checksum of its
numbers and the name of its study.  What is cut, changed or missing does not fit, and is computed again.
"""

import contextlib
import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import jax
import numpy as np

from ..atomic_write import write_atomic

_FORMAT = 2  # 1 was a group of zarr


class StudyError(Exception):
    """A study that cannot be begun, continued or written; what was written stays.

    Attributes:
        study: the Dataset of the designs computed up to an interrupt, the others "not run"; else None.  In a notebook
            `sys.last_value.study`.
    """

    study: Any = None


class StudyStore:
    """The folder of a study; nothing is written before `writing`.

    Args:
        path: the folder.
        spans: the rows of every chunk, which are written together.
        arrays: shape and type of one row by name.
        about: what makes this study itself: a store of another one is refused.

    Raises: StudyError for a folder that holds something else or another study.
    """

    def __init__(self, path: str | os.PathLike, spans: list[slice], arrays: Mapping[str, Any], about: Mapping):
        self.path, self.spans, self._arrays = Path(path), spans, dict(arrays)
        sizes = {"format": _FORMAT, "rows": spans[-1].stop, "chunk": spans[0].stop}
        self._about = json.loads(json.dumps(sizes | dict(about)))
        self._name = hashlib.sha256(json.dumps(self._about, sort_keys=True).encode()).hexdigest()
        self._known, self._chunks = self.path / "study.json", self.path / "chunks"
        self._check()

    def _check(self) -> None:
        if not self._known.exists():
            if self.path.exists() and (not self.path.is_dir() or any(self._others())):
                raise StudyError(f"{self.path} is there and is no study: choose another folder")
            return
        try:
            before = dict(json.loads(self._known.read_text()))
        except (OSError, ValueError, TypeError) as error:
            raise StudyError(
                f"{self._known} says no longer which study this is ({error}): put it back, or delete {self.path}"
            ) from error
        began = before.pop("jax", "?")
        changed = [name for name in {*before, *self._about} if before.get(name) != self._about.get(name)]
        if changed:
            made = f" (it was begun with jax {began}, this is {jax.__version__})" if began != jax.__version__ else ""
            raise StudyError(
                f"{self.path} holds another study, it differs in {', '.join(sorted(changed))}{made}: "
                "choose another folder or delete this one"
            )

    def _others(self):
        return (entry for entry in self.path.iterdir() if entry.name != "chunks" and not entry.name.startswith("."))

    def read(self, number: int) -> dict[str, np.ndarray] | None:
        """Read the rows of a chunk; None if they are missing or damaged."""
        try:
            head, _, body = self._file(number).read_bytes().partition(b"\n")
        except OSError:
            return None
        if head != self._head(number, body):
            return None
        found, begin, count = {}, 0, self.spans[number].stop - self.spans[number].start
        for name, one in self._arrays.items():
            size = count * int(np.prod(one.shape))
            values = np.frombuffer(body, one.dtype, size, begin)
            found[name], begin = values.reshape(count, *one.shape), begin + values.nbytes
        return found

    @contextlib.contextmanager
    def writing(self) -> Iterator[None]:
        """Context in which this process writes and no other.

        Raises: StudyError where another one does, or the disk takes nothing.
        """
        from filelock import FileLock, Timeout

        try:
            self._chunks.mkdir(parents=True, exist_ok=True)
            lock = FileLock(self.path / ".lock")
            lock.acquire(timeout=0)
        except Timeout as error:
            raise StudyError(f"{self.path} is being written by another process: wait for it, or end it") from error
        except OSError as error:
            raise StudyError(f"{self.path} cannot be written: {error.strerror or error}") from error
        try:
            self._begin()
            yield
        finally:
            lock.release()

    def _begin(self) -> None:
        """Delete the partial files of a killed process and write the description of the study."""
        self._check()
        try:
            for half in (*self.path.glob(".study-*"), *self._chunks.glob(".*")):
                half.unlink()
            if not self._known.exists():
                write_atomic(self._known, json.dumps({**self._about, "jax": jax.__version__}, indent=1))
        except OSError as error:
            raise StudyError(f"{self.path} cannot be written: {error.strerror or error}") from error

    @property
    def has_layout(self) -> bool:
        """True where the designs are kept in the folder."""
        return (self.path / "layout.npz").exists()

    def write_layout(self, layout: bytes) -> None:
        """Write designs and dimensions, for those who open the study without its function."""
        write_atomic(self.path / "layout.npz", layout)

    def write(self, number: int, arrays: Mapping[str, np.ndarray]) -> None:
        """Write the rows of a chunk.  Raises: OSError if the disk does not take them."""
        body = b"".join(np.ascontiguousarray(arrays[name], one.dtype).tobytes() for name, one in self._arrays.items())
        write_atomic(self._file(number), self._head(number, body) + b"\n" + body)

    def _file(self, number: int) -> Path:
        return self._chunks / f"{number:06d}"

    def _head(self, number: int, body: bytes) -> bytes:
        about = {"study": self._name, "chunk": number, "sha256": hashlib.sha256(body).hexdigest()}
        return json.dumps(about).encode()


def chunk_spans(rows: int, chunk: int) -> list[slice]:
    """The rows of every chunk; the last one may be shorter."""
    return [slice(begin, min(begin + chunk, rows)) for begin in range(0, rows, chunk)]


def hash_columns(columns: Mapping[str, np.ndarray]) -> str:
    """SHA-256 of names and numbers of designs."""
    found = hashlib.sha256()
    for name, column in columns.items():
        found.update(f"{name}{column.dtype}{column.shape}".encode())
        found.update(np.ascontiguousarray(column).tobytes())
    return found.hexdigest()
