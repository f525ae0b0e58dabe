"""Block-sparse linear systems: pattern, ordering, factorisation, solution; vmapped and differentiable."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._factorisation import Factor, factor, is_finite, log_determinant, matrix_inertia, solve, solve_once
    from ._matrix import BlockMatrix, assemble
    from ._operator import BlockOperator, BlockSolver
    from ._pattern import Pattern
    from ._plan import Plan, analyse

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
    "is_finite",
    "log_determinant",
    "matrix_inertia",
    "solve",
    "solve_once",
]

import_when_asked(__name__, explain_arguments)
