"""Motions in time."""

from .gauss import Gauss4, ImplicitMidpoint
from .integrate import simulate
from .motion import Diagnostics, Motion
from .peaks import Peak, peak
from .solvers import SemiImplicitEuler

__all__ = [
    "Diagnostics",
    "Gauss4",
    "ImplicitMidpoint",
    "Motion",
    "Peak",
    "SemiImplicitEuler",
    "peak",
    "simulate",
]
