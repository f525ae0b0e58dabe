"""Linear systems: matrices over named coordinates, condensation, checks, statics, transfer functions."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._block_matrices import block_matrices
    from ._check import Check, check
    from ._condensation import constraint_modes, interface_basis, partition
    from ._rigid_motions import rigid_motions
    from ._static_response import StaticResponse, equilibrium, static_response
    from ._system import LinearSystem
    from ._transfer import TransferFunctions

__all__ = [
    "Check",
    "LinearSystem",
    "StaticResponse",
    "TransferFunctions",
    "block_matrices",
    "check",
    "constraint_modes",
    "equilibrium",
    "interface_basis",
    "partition",
    "rigid_motions",
    "static_response",
]

import_when_asked(__name__, explain_arguments)
