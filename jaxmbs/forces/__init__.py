"""Force laws: one law per file, each a port from motion to effort."""

from ._actuator import PD, Actuator
from ._applied import Force, Torque, Wrench
from ._base import AbstractBodyLaw, AbstractLaw, AbstractPoseLaw, AbstractScalarLaw, AbstractSystemLaw
from ._bump_stop import BumpStop
from ._bushing import Bushing
from ._friction import CoulombFriction
from ._generalised import GeneralisedEffort
from ._maxwell import Maxwell
from ._signals import AbstractSignal, Constant, Harmonic, Polynomial, Ramp, Spline, Step
from ._spring_damper import SpringDamper
from ._state_laws import (
    AbstractBodyStateLaw,
    AbstractPoseStateLaw,
    AbstractScalarStateLaw,
    AbstractStateLaw,
    AbstractSystemStateLaw,
    InternalState,
)
from ._table import Table

__all__ = [
    "AbstractBodyLaw",
    "AbstractBodyStateLaw",
    "AbstractLaw",
    "AbstractPoseLaw",
    "AbstractPoseStateLaw",
    "AbstractScalarLaw",
    "AbstractScalarStateLaw",
    "AbstractSignal",
    "AbstractStateLaw",
    "AbstractSystemLaw",
    "AbstractSystemStateLaw",
    "Actuator",
    "BumpStop",
    "Bushing",
    "Constant",
    "CoulombFriction",
    "Force",
    "GeneralisedEffort",
    "Harmonic",
    "InternalState",
    "Maxwell",
    "PD",
    "Polynomial",
    "Ramp",
    "Spline",
    "SpringDamper",
    "Step",
    "Table",
    "Torque",
    "Wrench",
]
