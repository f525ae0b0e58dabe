"""Integration of ordinary differential equations: the loop of steps, its derivatives, events and solvers."""

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
