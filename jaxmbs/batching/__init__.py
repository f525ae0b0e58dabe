"""Batches: one function over many designs, compiled once, on all cores or devices."""

from ..arguments import explain_arguments
from ._batch import Batch, batch

__all__ = [
    "Batch",
    "batch",
]

explain_arguments(globals())
