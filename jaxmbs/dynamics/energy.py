"""Kinetic and potential energy."""

import jax.numpy as jnp

from ..kinematics.configuration import Moving, at_state, moving
from ..kinematics.state import State
from ..math.spatial import dot, momentum, unpack
from ..model.question import question
from ..model.system import System
from ..typing import Scalar
from .efforts import stored_energy
from .elastic import elastic_energies


def energies(system: System, at: Moving):
    """(kinetic, potential) energy [J]; Source: S2 (36)-(37), and V of gravity (75) and springs (70)."""
    v = unpack(at.V)
    kinetic = 0.5 * jnp.sum(dot(v, momentum(unpack(at.J), v)))
    moment = jnp.sum(at.J[:, 1:4], axis=0) + jnp.sum(at.J[:, 0]) * at.origin
    potential = stored_energy(system, at) - jnp.dot(system.gravity, moment)
    if not system.elastic:
        return kinetic, potential
    moving, lifted = elastic_energies(system, at)
    return kinetic + moving, potential + lifted


def _of_state(system, state):
    return energies(system, moving(system, at_state(system, state), state.velocities))


@question
def kinetic_energy(system: System, state: State) -> Scalar:
    """Kinetic energy [J] of a state: the energy `1/2 p.I*^-1 p` and the coenergy `1/2 phi_dot.I* phi_dot` alike.

    So, without potential, the Lagrangian and its Legendre transform, the Hamiltonian.  (46) prints p_dot for p.
    Source: S2 (36)-(37), (45)-(46).
    """
    return _of_state(system, state)[0]


@question
def potential_energy(system: System, state: State) -> Scalar:
    """Potential energy [J] of gravity (zero at the world origin) and of all springs."""
    return _of_state(system, state)[1]
