"""The saddle system of a mechanism by either block-sparse solver."""

from ..constraints._frontal_saddle import frontal_saddle
from ..constraints._saddle_operator import ConstraintOperator
from ..kinematics._configuration import Configuration
from ..model._system import System
from ._sparse_saddle import sparse_saddle


def saddle_without_matrix(
    method: str, system: System, at: Configuration, rows: ConstraintOperator, b, c, mass=1.0, weight=None, **options
):
    """Accelerations (nv,) and multipliers y (rows,) of `m M a + diag(w) a + A^T y = b`, `A a = c`.

    Args: method: "frontal" or "multifrontal"; mass: (), m; weight: w (nv,), default zero; options: of the frontal
        method.
    """
    if method == "frontal":
        return frontal_saddle(system, at, rows, b, c, mass, weight, **options)
    return sparse_saddle(system, at, rows, b, c, mass, weight)
