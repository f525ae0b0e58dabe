"""Motions in time."""

from .gauss import Gauss4 as Gauss4
from .gauss import ImplicitMidpoint as ImplicitMidpoint
from .integrate import simulate as simulate
from .motion import Diagnostics as Diagnostics
from .motion import Motion as Motion
from .peaks import Peak as Peak
from .peaks import peak as peak
from .solvers import SemiImplicitEuler as SemiImplicitEuler
