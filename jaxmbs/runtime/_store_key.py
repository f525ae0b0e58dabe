"""Keys of the store: all that decides what a function traces, as one name; the same in every process."""

import dataclasses
import functools
import hashlib
import os
import re
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import equinox as eqx
import jax

from . import _tuning as tuning
from ._cache import cpu_name
from ._code_content import UnknownContentError
from ._content import content_of
from ._tricks import OFF

_START = time.time()
_LIBRARY = Path(__file__).parents[1]
_OTHERS = re.compile(r"(jax|jaxlib|numpy|scipy|equinox|diffrax|lineax|optimistix|optax|jaxtyping)-.*\.dist-info")
#: Settings of JAX that say where programs are kept and what is told of them, not what they compute.
_TELLING = re.compile("cache|log|traceback|profil|dump|pprint|explain|report|traced_arg|file|url")


@dataclasses.dataclass(frozen=True)
class _Shape:
    """An array of the arguments, whose numbers do not decide what is traced."""

    shape: tuple[int, ...]
    dtype: str
    is_weak: bool


def question_key(function: Any, dynamic: Any, static: Any) -> str | None:
    """The key of a function and its arguments, parted into arrays and what is static; None if it has none, since
    something of it cannot be known by its content.
    """
    library = _library()
    if library is None:
        return None
    shapes = jax.tree.map(lambda x: _Shape(x.shape, str(x.dtype), bool(getattr(x, "weak_type", False))), dynamic)
    try:
        return content_of([library, *_settings(), function, eqx.combine(shapes, static)])
    except (UnknownContentError, RecursionError):
        return None


def _settings() -> Iterator[Any]:
    """Settings that may change while a process runs."""
    yield sorted(OFF.value)
    yield {name: value for name, value in vars(tuning).items() if name.isupper()}
    yield os.environ.get("XLA_FLAGS", "")
    for name in sorted(jax.config.values):
        if not _TELLING.search(name):
            yield name
            yield str(setting(name))


def setting(name: str) -> Any:
    """A setting of JAX, that of the context in which it is asked for."""
    return getattr(jax.config, name, None)


@functools.cache
def _library() -> str | None:
    """A name for the code of this library, the versions of others, and the machine; None if a file was changed since
    the process began, so that what is imported may be another."""
    found = hashlib.sha256(f"{sys.version} {sys.platform} {cpu_name()}".encode())
    for path in sorted(_others()):
        found.update(path.encode())
    for file in _sources(str(_LIBRARY)):
        if file.stat().st_mtime > _START:
            return None
        found.update(file.path.removeprefix(str(_LIBRARY)).encode())
        found.update(Path(file.path).read_bytes())
    return found.hexdigest()


def _others() -> Iterator[str]:
    """Names and versions of the libraries that this one is made of."""
    for folder in sys.path:
        if os.path.isdir(folder):
            yield from filter(_OTHERS.fullmatch, os.listdir(folder))


def _sources(folder: str) -> Iterator[os.DirEntry]:
    for entry in sorted(os.scandir(folder), key=lambda entry: entry.name):
        if entry.is_dir():
            yield from _sources(entry.path)
        elif entry.name.endswith((".py", ".c", ".h", ".so")):
            yield entry
