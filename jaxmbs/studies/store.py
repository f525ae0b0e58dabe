"""A study on disk: zarr arrays with one row per design, and which chunks of them are done.

A chunk counts as done when its marker stands beside the arrays, which is put there after its numbers, so a process
that is killed loses the chunk that was being computed and nothing else.
"""

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np


class StudyError(Exception):
    """A study that cannot be begun, continued or written; what was written stays."""


class Store:
    """Opened for writing by one process; close it, or use it in a `with` statement.

    Args:
        path: the folder.
        rows: number of designs; chunk: how many are written together.
        arrays: shape and type of one row by name.
        about: what makes this study itself: a store of another one is refused.

    Raises: StudyError for a folder that holds something else or another study, or that another process writes.
    """

    def __init__(self, path: str | os.PathLike, rows: int, chunk: int, arrays: Mapping[str, Any], about: Mapping):
        import zarr
        from filelock import FileLock, Timeout

        self.path, self.rows, self.chunk = Path(path), rows, chunk
        known = self.path / "study.json"
        if self.path.exists() and not known.exists() and any(self._others()):
            raise StudyError(f"{self.path} is there and is no study: choose another folder")
        self.path.mkdir(parents=True, exist_ok=True)
        self._lock = FileLock(self.path / ".lock")
        try:
            self._lock.acquire(timeout=0)
        except Timeout as error:
            raise StudyError(f"{self.path} is being written by another process: wait for it, or end it") from error
        try:
            self._begin(zarr, known, arrays, {"rows": rows, "chunk": chunk, **about})
        except BaseException:
            self.close()
            raise

    def _others(self):
        return (entry for entry in self.path.iterdir() if entry.name not in (".lock", "done", "study.json.part"))

    def _begin(self, zarr, known, arrays, about):
        about = json.loads(json.dumps(about))
        if known.exists():
            before = json.loads(known.read_text())
            changed = [name for name in {*before, *about} if before.get(name) != about.get(name)]
            if changed:
                raise StudyError(
                    f"{self.path} holds another study, it differs in {', '.join(sorted(changed))}: "
                    "choose another folder or delete this one"
                )
            self.group = zarr.open_group(self.path / "data", mode="r+")
            return
        self.group = zarr.open_group(self.path / "data", mode="w")
        for name, one in arrays.items():
            floating = np.issubdtype(one.dtype, np.inexact)
            self.group.create_array(
                name,
                shape=(self.rows, *one.shape),
                chunks=(self.chunk, *(max(n, 1) for n in one.shape)),
                dtype=one.dtype,
                fill_value=np.nan if floating else -1 if np.issubdtype(one.dtype, np.signedinteger) else 0,
            )
        (self.path / "done").mkdir(exist_ok=True)
        _put(known, json.dumps(about, indent=1))  # last: without it nothing has begun

    @property
    def left(self) -> list[int]:
        """Numbers of the chunks that are not done."""
        done = {int(entry.name) for entry in (self.path / "done").iterdir() if entry.suffix == ""}
        return [k for k in range(-(-self.rows // self.chunk)) if k not in done]

    def span(self, number: int) -> slice:
        """The rows of a chunk."""
        return slice(number * self.chunk, min((number + 1) * self.chunk, self.rows))

    def write(self, number: int, arrays: Mapping[str, np.ndarray]) -> None:
        """The rows of a chunk, then its marker.

        Raises: StudyError where the disk does not take them.
        """
        rows = self.span(number)
        try:
            for name, values in arrays.items():
                self.group[name][rows] = values
            _put(self.path / "done" / str(number), "")
        except OSError as error:
            kept = self.rows - sum(self.span(k).stop - self.span(k).start for k in self.left)
            raise StudyError(
                f"{self.path}: {error.strerror or error}; {kept} of {self.rows} designs are kept, "
                "run the same study again to go on"
            ) from error

    def read(self, name: str) -> np.ndarray:
        """All rows of an array; what is not done is nan, -1 of whole numbers."""
        return self.group[name][:]

    def close(self) -> None:
        """Let others write."""
        self._lock.release()

    def __enter__(self) -> "Store":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def digest(columns: Mapping[str, np.ndarray]) -> str:
    """Of names and numbers of designs."""
    found = hashlib.sha256()
    for name, column in columns.items():
        found.update(f"{name}{column.dtype}{column.shape}".encode())
        found.update(np.ascontiguousarray(column).tobytes())
    return found.hexdigest()


def _put(path: Path, text: str) -> None:
    """A file that is there as a whole or not at all."""
    part = path.with_suffix(".part")
    with open(part, "w") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    os.replace(part, path)
