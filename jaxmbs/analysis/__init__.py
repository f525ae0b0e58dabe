"""Questions about a mechanism at rest or beside a state: equilibrium, linear system, modes, stiffness."""

from .linearisation import Linearisation, StateSpace, frequency_response, linearise
from .mechanism_modes import modes
from .rest import Equilibrium, equilibrium
from .stiffness_parts import Stiffness, stiffness

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
