"""Design: finding the numbers of a model that make an objective small."""

from jaxmbs.design.batches import Batch, batch
from jaxmbs.design.limit import Limit
from jaxmbs.design.limit_result import LimitResult
from jaxmbs.design.optimise import minimise
from jaxmbs.design.optimum import History, Optimum

__all__ = [
    "Batch",
    "History",
    "Limit",
    "LimitResult",
    "Optimum",
    "batch",
    "minimise",
]
