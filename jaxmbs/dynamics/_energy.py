"""Kinetic and potential energy."""

import jax.numpy as jnp

from ..assembly._state import State
from ..kinematics._configuration import VelocityKinematics, at_state, with_velocities
from ..model._entry_points import state_function
from ..model._system import System
from ..typing import Scalar
from ._bodies import bodies_of, total
from ._efforts import stored_energy


def energies(system: System, at: VelocityKinematics, ends: list | None = None):
    """Kinetic and potential energy [J]; Source: S2 (36)-(37), and V of gravity (75) and springs (70).

    Args: ends: as of `stored_energy`.
    """
    kinetic, lifted = zip(*(bodies.energies(system, at) for bodies in bodies_of(system)), strict=True)
    return total(kinetic), stored_energy(system, at, ends) - jnp.dot(system.gravity, total(lifted))


def _energies_of_state(system, state):
    return energies(system, with_velocities(system, at_state(system, state), state.velocities))


@state_function
def kinetic_energy(system: System, state: State) -> Scalar:
    """Kinetic energy [J] of a state: the energy `1/2 p.I*^-1 p` and the coenergy `1/2 phi_dot.I* phi_dot` alike.

    So, without potential, the Lagrangian and its Legendre transform, the Hamiltonian.  (46) prints p_dot for p.
    Source: S2 (36)-(37), (45)-(46).
    """
    return _energies_of_state(system, state)[0]


@state_function
def potential_energy(system: System, state: State) -> Scalar:
    """Potential energy [J] of gravity (zero at the world origin) and of all springs."""
    return _energies_of_state(system, state)[1]
