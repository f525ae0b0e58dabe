"""Design: finding the numbers of a model that make an objective small."""

from jaxmbs.design.batches import Batch, batch
from jaxmbs.design.front import Front, pareto
from jaxmbs.design.limit import Limit
from jaxmbs.design.limit_result import LimitResult
from jaxmbs.design.optimise import minimise
from jaxmbs.design.optimum import History, Optimum
from jaxmbs.design.scatter import Scatter, Tolerance, scattered, sensitivities, tolerances

__all__ = [
    "Batch",
    "Front",
    "History",
    "Limit",
    "LimitResult",
    "Optimum",
    "Scatter",
    "Tolerance",
    "batch",
    "minimise",
    "pareto",
    "scattered",
    "sensitivities",
    "tolerances",
]
