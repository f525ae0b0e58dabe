"""Integration of ordinary differential equations: the loop of steps, its derivatives, events and solvers."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._gauss import Gauss4, ImplicitMidpoint
    from ._projected_solver import ProjectedSolver
    from ._rosenbrock import Rodas5P
    from ._semi_implicit_euler import SemiImplicitEuler

__all__ = [
    "Gauss4",
    "ImplicitMidpoint",
    "ProjectedSolver",
    "Rodas5P",
    "SemiImplicitEuler",
]

import_when_asked(__name__, explain_arguments)
