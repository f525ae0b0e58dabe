"""Origin of the numbers of a report: versions, the device they were calculated on, a digest of the model."""

import hashlib
import importlib.metadata
import platform
from datetime import UTC, datetime
from typing import Any

import jax
import numpy as np

from ..runtime import content_of
from ._page import Passage

_PACKAGES = ("jax", "jaxlib", "equinox", "diffrax", "numpy", "scipy")


def provenance_section(system: Any) -> list[Passage]:
    """Versions, time and digest."""
    from .. import __version__

    rows = [("what", "value"), ("jaxmbs", __version__)]
    rows += [(name, importlib.metadata.version(name)) for name in _PACKAGES]
    rows += [
        ("Python", platform.python_version()),
        ("device", f"{jax.default_backend()}, {platform.machine()}"),
        ("written", datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")),
    ]
    if system is not None:
        rows.append(("digest of the model (SHA-256)", digest(system)))
    return [Passage("Made with", ["Units are SI and radians unless a table says otherwise."], rows)]


def digest(model: Any) -> str:
    """SHA-256 of the structure and of all numbers of a model: another one is another model."""
    arrays, structure = jax.tree.flatten(model)
    found = hashlib.sha256(content_of(structure, strict=False).encode())
    for array in map(np.asarray, arrays):
        found.update(f"{array.dtype}{array.shape}".encode() + np.ascontiguousarray(array).tobytes())
    return found.hexdigest()
