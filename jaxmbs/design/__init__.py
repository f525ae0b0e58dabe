"""Design: finding the numbers of a model that make an objective small."""

from ..arguments import explain_arguments
from ._limit import Limit
from ._limit_result import LimitResult
from ._minimise import minimise
from ._optimum import History, Optimum
from ._pareto import ParetoFront, pareto
from ._uncertainty import Tolerance, Uncertainty, propagate_uncertainty, sensitivities, tolerances
from ._worst import Worst

__all__ = [
    "History",
    "Limit",
    "LimitResult",
    "Optimum",
    "ParetoFront",
    "Tolerance",
    "Uncertainty",
    "Worst",
    "minimise",
    "pareto",
    "propagate_uncertainty",
    "sensitivities",
    "tolerances",
]

explain_arguments(globals())
