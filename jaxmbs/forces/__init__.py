"""Force laws: one law per file, each a port from motion to effort."""

from .actuator import PD as PD
from .actuator import Actuator as Actuator
from .applied import Force as Force
from .applied import Torque as Torque
from .applied import Wrench as Wrench
from .base import AbstractBodyLaw as AbstractBodyLaw
from .base import AbstractLaw as AbstractLaw
from .base import AbstractPoseLaw as AbstractPoseLaw
from .base import AbstractScalarLaw as AbstractScalarLaw
from .base import AbstractSystemLaw as AbstractSystemLaw
from .bump_stop import BumpStop as BumpStop
from .bushing import Bushing as Bushing
from .friction import CoulombFriction as CoulombFriction
from .generalised import GeneralisedEffort as GeneralisedEffort
from .signals import AbstractSignal as AbstractSignal
from .signals import Constant as Constant
from .signals import Harmonic as Harmonic
from .signals import Polynomial as Polynomial
from .signals import Ramp as Ramp
from .signals import Spline as Spline
from .signals import Step as Step
from .spring_damper import SpringDamper as SpringDamper
from .table import Table as Table
