"""Force laws: one law per file, each a port from motion to effort."""

from .actuator import PD, Actuator
from .applied import Force, Torque, Wrench
from .base import AbstractBodyLaw, AbstractLaw, AbstractPoseLaw, AbstractScalarLaw, AbstractSystemLaw
from .bump_stop import BumpStop
from .bushing import Bushing
from .friction import CoulombFriction
from .generalised import GeneralisedEffort
from .signals import AbstractSignal, Constant, Harmonic, Polynomial, Ramp, Spline, Step
from .spring_damper import SpringDamper
from .table import Table

__all__ = [
    "AbstractBodyLaw",
    "AbstractLaw",
    "AbstractPoseLaw",
    "AbstractScalarLaw",
    "AbstractSignal",
    "AbstractSystemLaw",
    "Actuator",
    "BumpStop",
    "Bushing",
    "Constant",
    "CoulombFriction",
    "Force",
    "GeneralisedEffort",
    "Harmonic",
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
