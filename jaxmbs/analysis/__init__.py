"""Analyses of a mechanism at a state: equilibrium, linearisation, modes, frequency response, stiffness; Campbell
diagrams."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._campbell import CampbellDiagram, campbell
    from ._equilibrium import equilibrium
    from ._equilibrium_result import Equilibrium
    from ._impending_motion import ImpendingMotion, impending_motion
    from ._linearisation import Linearisation
    from ._linearise import frequency_response, linearise
    from ._mechanism_modes import modes
    from ._stiffness import Stiffness, stiffness

__all__ = [
    "CampbellDiagram",
    "Equilibrium",
    "ImpendingMotion",
    "Linearisation",
    "Stiffness",
    "campbell",
    "equilibrium",
    "frequency_response",
    "impending_motion",
    "linearise",
    "modes",
    "stiffness",
]

import_when_asked(__name__, explain_arguments, {"StateSpace": "jaxmbs.blocks"})  # for one release
