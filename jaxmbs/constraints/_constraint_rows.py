"""Constraint rows of a state: residuals of loops, drives and couplers, and their Jacobian."""

from jaxtyping import Array, Float

from ..kinematics._configuration import at_state
from ..model._entry_points import state_function
from ..model._system import AbstractState, System
from ._constraints import jacobian, residual


@state_function
def constraint_residual(system: System, state: AbstractState) -> Float[Array, " rows"]:
    """Residual f(psi, t) (rows,) of all loops, drives and couplers; zero when assembled.  Source: S2 (1)-(2)."""
    return residual(system, at_state(system, state, inertias=False))


@state_function
def constraint_jacobian(system: System, state: AbstractState) -> Float[Array, "rows nv"]:
    """Velocity rows A (rows, nv): `A u + f_t = 0`.  Source: S2 (3), (5)."""
    return jacobian(system, at_state(system, state, inertias=False))
