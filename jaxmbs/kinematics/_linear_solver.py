"""The solver for the saddle systems of a mechanism, chosen by the size of the system and the width of its front."""

from ..model._system import System
from ..runtime import tuning
from ._front_plan import front_plan
from ._saddle_operator import row_kinds

SOLVERS = ("dense", "frontal", "multifrontal")


def linear_solver(system: System) -> str:
    """The solver that the build was asked for, or by default the fastest: "dense", "frontal" or "multifrontal".

    Small systems are dense.  Larger ones take the front where it is narrow and no body deforms, and the multifrontal
    factor else.
    """
    if system.topology.linear_solver != "auto":
        return system.topology.linear_solver
    if system.topology.num_velocities < tuning.DENSE_VELOCITIES or not system.has_constraints:
        return "dense"
    return "frontal" if has_narrow_front(system) else "multifrontal"


def has_narrow_front(system: System) -> bool:
    """True if no body deforms, few rows read any column, and the front is narrow enough for the frontal method."""
    is_local = not system.elastic and len(row_kinds(system).others) <= tuning.BORDER_ROWS
    return is_local and front_plan(system).width <= tuning.FRONT_WIDTH
