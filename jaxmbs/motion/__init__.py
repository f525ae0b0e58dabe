"""Motions in time."""

from .formulation import Formulation, Rates
from .gauss import Gauss4, ImplicitMidpoint
from .integrate import simulate
from .joint_peaks import LoadPeaks, load_peaks
from .motion import Diagnostics, Motion
from .peaks import Peak, peak
from .solvers import SemiImplicitEuler

__all__ = [
    "Diagnostics",
    "Formulation",
    "Gauss4",
    "ImplicitMidpoint",
    "LoadPeaks",
    "Motion",
    "Peak",
    "Rates",
    "SemiImplicitEuler",
    "load_peaks",
    "peak",
    "simulate",
]
