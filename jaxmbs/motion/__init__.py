"""Motions in time."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._diagnostics import Diagnostics
    from ._event import Event
    from ._event_record import EventRecord
    from ._formulation import Formulation, Rates
    from ._joint_peaks import LoadPeaks, load_peaks
    from ._motion import Motion
    from ._peaks import Peak, peak
    from ._simulate import simulate
    from ._vector_field import PhaseState, VectorField, vector_field

__all__ = [
    "Diagnostics",
    "Event",
    "EventRecord",
    "Formulation",
    "LoadPeaks",
    "Motion",
    "Peak",
    "PhaseState",
    "Rates",
    "VectorField",
    "load_peaks",
    "peak",
    "simulate",
    "vector_field",
]

_SOLVERS = ("Gauss4", "ImplicitMidpoint", "ProjectedSolver", "Rodas5P", "SemiImplicitEuler")

import_when_asked(__name__, explain_arguments, dict.fromkeys(_SOLVERS, "jaxmbs.ode"))  # these for one release
