"""Probability: distributions of uncertain numbers, their correlation, and integrals of normal ones."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._beta import Beta
    from ._distribution import AbstractDistribution
    from ._empirical import Empirical
    from ._families import Gumbel, LogNormal, Normal, Triangular, Uniform, Weibull
    from ._random_variables import RandomVariables

__all__ = [
    "AbstractDistribution",
    "Beta",
    "Empirical",
    "Gumbel",
    "LogNormal",
    "Normal",
    "RandomVariables",
    "Triangular",
    "Uniform",
    "Weibull",
]

import_when_asked(__name__, explain_arguments)
