"""Block-sparse linear systems: pattern, ordering, factorisation, solution; vmapped and differentiable."""

from .factorisation import Factor, factor, inertia, is_finite, log_determinant, solve, solve_once
from .matrix import BlockMatrix, assemble
from .operator import BlockOperator, BlockSolver
from .pattern import Pattern
from .plan import Plan, analyse

__all__ = [
    "BlockMatrix",
    "BlockOperator",
    "BlockSolver",
    "Factor",
    "Pattern",
    "Plan",
    "analyse",
    "assemble",
    "factor",
    "inertia",
    "is_finite",
    "log_determinant",
    "solve",
    "solve_once",
]
