"""The Hamiltonian on the independent coordinates and their momenta, and its slopes: Hamilton's equations.

With `u = Gamma phi_dot + b` (b: what drives prescribe) the kinetic coenergy, the paper's Lagrangian, is
`L = 1/2 phi_dot.I* phi_dot + c.phi_dot + T0`, so `p = I* phi_dot + c` and `H = p.phi_dot - L`.
"""

import jax
from jaxtyping import Array, Float

from ...assembly._state import State
from ...constraints._kic import independent_columns, velocity_map
from ...constraints._kic_second import along_independent
from ...constraints._mobility import independent_state_function
from ...kinematics._configuration import Configuration, at_state
from ...kinematics._elastic import mass_matrix
from ...math._spd import spd_solve
from ...model._system import System
from ...runtime import as_dtype
from ...typing import ArrayLike, Scalar
from ._fields import require_holonomic_coordinates


@independent_state_function
def hamiltonian(system: System, state: State, momenta: ArrayLike | None = None) -> Scalar:
    """`H = 1/2 (p - c).I*^-1 (p - c) - T0` [J] at the coordinates and time of a state, dependent ones following.

    Without drives c and T0 are zero: H is the kinetic energy `1/2 p.I*^-1 p`.  Potentials stand with the efforts Q,
    as in the paper.

    Args:
        momenta: p (N,), by default those of the state; the state's velocities then count no more.

    Raises: ValueError for another number of momenta.  Source: S2 (36), (45)-(46); (46) prints p_dot for p.
    """
    at = at_state(system, state)
    return _hamiltonian_at(system, at, _momenta(system, at, state, momenta))


@independent_state_function
def hamiltonian_slopes(
    system: System, state: State, momenta: ArrayLike | None = None
) -> tuple[Float[Array, " N"], Float[Array, " N"]]:
    """Slopes dH/dphi at fixed p and dH/dp at fixed phi, each (N,): `p_dot = -dH/dphi + Q`, `phi_dot = dH/dp`.

    The first is the total derivative along the loops, `-dL/dphi` at fixed velocities and so `-GR phi_dot`; for
    coordinates that are integrals of their velocities (no balls, no rolling: their Hamilton equations have more
    terms).  Arguments as for `hamiltonian`.

    Raises: as `hamiltonian`; ModelError for quaternions and rows of velocity alone.
    Source: S2 (47)-(49), (51)-(52); of drives too.
    """
    require_holonomic_coordinates(system, "hamiltonian_slopes", driven=False)
    at = at_state(system, state)
    p = _momenta(system, at, state, momenta)
    along_phi = along_independent(system, at, lambda at: _hamiltonian_at(system, at, p))
    return along_phi, jax.grad(lambda p: _hamiltonian_at(system, at, p))(p)


def _momenta(system, at, state, given):
    if given is None:
        return velocity_map(system, at)[0].T @ (mass_matrix(system, at) @ state.velocities)
    p, count = as_dtype(given, at.psi.dtype), len(independent_columns(system))
    if p.shape != (count,):
        raise ValueError(f"momenta must have shape ({count},), one for each independent velocity, not {p.shape}")
    return p


def _hamiltonian_at(system: System, at: Configuration, p):
    Gamma, b = velocity_map(system, at)
    M = mass_matrix(system, at)
    free = p - Gamma.T @ (M @ b)
    return 0.5 * free @ spd_solve(Gamma.T @ M @ Gamma, free) - 0.5 * b @ (M @ b)
