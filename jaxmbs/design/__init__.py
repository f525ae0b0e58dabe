"""Design: finding the numbers of a model that make an objective small."""

from jaxmbs.design._limit import Limit
from jaxmbs.design._limit_result import LimitResult
from jaxmbs.design._minimise import minimise
from jaxmbs.design._optimum import History, Optimum
from jaxmbs.design._pareto import Front, pareto
from jaxmbs.design._uncertainty import Tolerance, Uncertainty, propagate_uncertainty, sensitivities, tolerances

__all__ = [
    "Front",
    "History",
    "Limit",
    "LimitResult",
    "Optimum",
    "Tolerance",
    "Uncertainty",
    "minimise",
    "pareto",
    "propagate_uncertainty",
    "sensitivities",
    "tolerances",
]
