"""Questions about a mechanism at rest or beside a state: equilibrium, linear system, modes, stiffness."""

from .equilibrium import Equilibrium as Equilibrium
from .equilibrium import equilibrium as equilibrium
from .linearise import Linearisation as Linearisation
from .linearise import StateSpace as StateSpace
from .linearise import frequency_response as frequency_response
from .linearise import linearise as linearise
from .modes import Modes as Modes
from .modes import modes as modes
from .stiffness import Stiffness as Stiffness
from .stiffness import elastic_stiffness as elastic_stiffness
from .stiffness import stiffness as stiffness
