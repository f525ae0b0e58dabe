"""Motions in time."""

from .formulation import Formulation, Rates
from .gauss import Gauss4, ImplicitMidpoint
from .integrate import simulate
from .motion import Diagnostics, Motion
from .peaks import Peak, peak
from .solvers import SemiImplicitEuler

__all__ = [
    "Diagnostics",
    "Formulation",
    "Gauss4",
    "ImplicitMidpoint",
    "Motion",
    "Peak",
    "Rates",
    "SemiImplicitEuler",
    "peak",
    "simulate",
]
