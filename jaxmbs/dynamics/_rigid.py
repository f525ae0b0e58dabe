"""Rigid bodies: all of a system in one group of arrays, those welded to a node as one.  Source: S2 (28)-(29)."""

import jax.numpy as jnp

from ..constraints._kic import body_kic
from ..math._spatial import cross, dot, momentum, momentum_by_matrix, momentum_rate, scale
from ._body import AbstractBodies
from ._loads import Loads


def gravity_wrench(J, gravity):
    """Wrench (nodes, 6, ...) of gravity on inertias J (nodes, 10, ...).  Source: S2 (75)."""
    g = jnp.broadcast_to(gravity.reshape((1, 3) + (1,) * (J.ndim - 2)), J[:, 1:4].shape)
    return jnp.concatenate([cross(J[:, 1:4], g), scale(g, J[:, 0])], axis=1)


class RigidBodies(AbstractBodies):
    """All rigid bodies of a system."""

    def mass(self, system):
        return jnp.sum(system.mass)

    def momenta(self, system, at):
        return Loads(momentum(at.J, at.V))

    def inertial_loads(self, system, at):
        return Loads(gravity_wrench(at.J, system.gravity))

    def inverse_dynamics_loads(self, system, at, V_dot, u_dot, owners):
        J, V, V_dot = owners.masses(at, V_dot)
        return Loads(momentum_rate(J, V, V_dot) - gravity_wrench(J, system.gravity))

    def acceleration_loads(self, system, at, V_dot, u_dot, owners):
        J, _, V_dot = owners.masses(at, V_dot)
        return Loads(momentum_by_matrix(J, V_dot))

    def energies(self, system, at):
        kinetic = 0.5 * jnp.sum(dot(at.V, momentum(at.J, at.V)))
        return kinetic, jnp.sum(at.J[:, 1:4], axis=0) + jnp.sum(at.J[:, 0]) * at.origin

    def weight(self, system, at, Gamma):
        return jnp.einsum("b,bcn,c->n", system.mass, body_kic(system, at, Gamma)[:, 3:], system.gravity)
