"""Design: finding the numbers of a model that make an objective small."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ..errors import SearchError
    from ._interior_point import InteriorPoint, interior_point
    from ._limit import Limit
    from ._limit_result import LimitResult
    from ._minimise import minimise
    from ._optimum import History, Optimum
    from ._pareto import ParetoFront, pareto
    from ._percentile import percentile
    from ._polynomial_chaos import PolynomialChaos, polynomial_chaos
    from ._reliability import reliability
    from ._reliability_result import Reliability
    from ._robust import Robust, moments
    from ._side_by_side import interior_point_batch
    from ._uncertainty import Tolerance, Uncertainty, propagate_uncertainty, sensitivities, tolerances
    from ._worst import Worst

__all__ = [
    "History",
    "InteriorPoint",
    "Limit",
    "LimitResult",
    "Optimum",
    "ParetoFront",
    "PolynomialChaos",
    "Reliability",
    "Robust",
    "SearchError",
    "Tolerance",
    "Uncertainty",
    "Worst",
    "interior_point",
    "interior_point_batch",
    "minimise",
    "moments",
    "pareto",
    "percentile",
    "polynomial_chaos",
    "propagate_uncertainty",
    "reliability",
    "sensitivities",
    "tolerances",
]

import_when_asked(__name__, explain_arguments)
