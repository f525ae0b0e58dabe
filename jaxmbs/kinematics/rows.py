"""The rows of loops, drives and couplers at a state: what they leave open, and their Jacobian."""

from jaxtyping import Array, Float

from ..model.question import question
from ..model.system import System
from .configuration import at_state
from .constraints import jacobian, residual
from .state import State


@question
def constraint_residual(system: System, state: State) -> Float[Array, " rows"]:
    """Residual f(psi, t) (rows,) of all loops, drives and couplers; zero when assembled.  Source: S2 (1)-(2)."""
    return residual(system, at_state(system, state, inertias=False))


@question
def constraint_jacobian(system: System, state: State) -> Float[Array, "rows nv"]:
    """Velocity rows A (rows, nv): `A u + f_t = 0`.  Source: S2 (3), (5)."""
    return jacobian(system, at_state(system, state, inertias=False))
