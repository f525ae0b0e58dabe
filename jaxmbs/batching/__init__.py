"""Batches: one function over many designs, compiled once, on all cores or devices."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._batch import Batch, batch

__all__ = [
    "Batch",
    "batch",
]

import_when_asked(__name__, explain_arguments)
