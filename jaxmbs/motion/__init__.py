"""Motions in time."""

from ..ode._gauss import Gauss4, ImplicitMidpoint
from ..ode._semi_implicit_euler import SemiImplicitEuler
from ._formulation import Formulation, Rates
from ._joint_peaks import LoadPeaks, load_peaks
from ._motion import Diagnostics, Motion
from ._peaks import Peak, peak
from ._simulate import simulate

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
