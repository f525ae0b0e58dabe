"""Questions about a mechanism at rest or beside a state: equilibrium, linear system, modes, stiffness."""

from .equilibrium import Equilibrium, equilibrium
from .linearise import Linearisation, StateSpace, frequency_response, linearise
from .modes import Modes, modes
from .stiffness import Stiffness, elastic_stiffness, stiffness

__all__ = [
    "Equilibrium",
    "Linearisation",
    "Modes",
    "StateSpace",
    "Stiffness",
    "elastic_stiffness",
    "equilibrium",
    "frequency_response",
    "linearise",
    "modes",
    "stiffness",
]
