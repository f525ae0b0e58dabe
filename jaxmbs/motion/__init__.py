"""Motions in time."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ..ode._gauss import Gauss4, ImplicitMidpoint
    from ..ode._projected_solver import ProjectedSolver
    from ..ode._rosenbrock import Rodas5P
    from ..ode._semi_implicit_euler import SemiImplicitEuler
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
    "Gauss4",
    "ImplicitMidpoint",
    "LoadPeaks",
    "Motion",
    "Peak",
    "PhaseState",
    "ProjectedSolver",
    "Rates",
    "Rodas5P",
    "SemiImplicitEuler",
    "VectorField",
    "load_peaks",
    "peak",
    "simulate",
    "vector_field",
]

import_when_asked(__name__, explain_arguments)
