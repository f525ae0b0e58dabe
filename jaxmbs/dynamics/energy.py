"""Kinetic and potential energy."""

import jax.numpy as jnp

from ..kinematics.poses import geometry, node_inertias, node_parameters
from ..math.spatial import dot, momentum, unpack
from ..model.question import question
from ..model.system import System
from .efforts import stored_energy
from .elastic import elastic_energies
from .newton_euler import node_motion


def energies_at(system: System, geo, J, V, psi, u, t):
    """(kinetic, potential) energy [J]; Source: S2 (36)-(37), and V of gravity (75) and springs (70)."""
    v = unpack(V)
    kinetic = 0.5 * jnp.sum(dot(v, momentum(unpack(J), v)))
    moment = jnp.sum(J[:, 1:4], axis=0) + jnp.sum(J[:, 0]) * geo.origin
    potential = stored_energy(system, geo, psi, t) - jnp.dot(system.gravity, moment)
    if not system.elastic:
        return kinetic, potential
    moving, lifted = elastic_energies(system, geo, psi, V, u)
    return kinetic + moving, potential + lifted


def energies(system: System, P, psi, u, t):
    """(kinetic, potential) energy [J] from the tree parameters P; see `energies_at`."""
    geo = geometry(system, P, psi)
    return energies_at(system, geo, node_inertias(P, geo.W), node_motion(system.topology, geo.S, u), psi, u, t)


@question
def kinetic_energy(system: System, state):
    """Kinetic energy [J] of a state: the energy `1/2 p.I*^-1 p` and the coenergy `1/2 phi_dot.I* phi_dot` alike.

    So, without potential, the Lagrangian and its Legendre transform, the Hamiltonian.  (46) prints p_dot for p.
    Source: S2 (36)-(37), (45)-(46).
    """
    return energies(system, node_parameters(system), state.coordinates, state.velocities, state.t)[0]


@question
def potential_energy(system: System, state):
    """Potential energy [J] of gravity (zero at the world origin) and of all springs."""
    return energies(system, node_parameters(system), state.coordinates, state.velocities, state.t)[1]
