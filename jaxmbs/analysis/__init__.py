"""Questions about a mechanism at rest or beside a state: equilibrium, linear system, modes, stiffness."""

from .equilibrium import Equilibrium, equilibrium
from .linearise import Linearisation, StateSpace, frequency_response, linearise
from .modes import modes
from .stiffness import Stiffness, stiffness

__all__ = [
    "Equilibrium",
    "Linearisation",
    "StateSpace",
    "Stiffness",
    "equilibrium",
    "frequency_response",
    "linearise",
    "modes",
    "stiffness",
]
