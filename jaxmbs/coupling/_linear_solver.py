"""The storage of a network's matrices, chosen by its size: dense, or blocks for the multifrontal method."""

from ..errors import ModelError
from ..runtime import tuning

SOLVERS = ("auto", "dense", "multifrontal")


def bond_solver(solver: str, num_bonds: int, num_rows: int, obstacle: str = "") -> str:
    """ "dense" or "multifrontal": the one asked for, or for "auto" the fastest at this size.

    Args: obstacle: reason why the network cannot be stored in blocks, if any.

    Raises: ModelError for an unknown solver, and for "multifrontal" where there is an obstacle.
    """
    if solver not in SOLVERS:
        raise ModelError([f"linear_solver must be one of {', '.join(map(repr, SOLVERS))}, got {solver!r}"])
    if solver == "multifrontal" and obstacle:
        raise ModelError([f"linear_solver='multifrontal': {obstacle}"])
    if solver != "auto":
        return solver
    large = num_bonds >= tuning.NETWORK_BONDS and num_rows >= tuning.NETWORK_ROWS
    return "multifrontal" if large and not obstacle else "dense"
