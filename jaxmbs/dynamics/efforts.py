"""Efforts of gravity and force elements on the tree, their stored energy and the power of each element.

Every law is carried to its nodes as a world wrench or to its own velocity column, so a new law never touches
kinematics.  Source: S2 (56)-(76), total `Q = Q* + e_C + e_R + e_G`.
"""

import jax
import jax.numpy as jnp
import numpy as np

from ..kinematics.configuration import Configuration, Moving, resting
from ..kinematics.poses import frame_twists
from ..math.spatial import cross, pack, scale, unpack
from ..model.system import System
from .elastic import elastic_efforts, strain_energy


def gravity_wrench(J, gravity):
    """Wrench (nodes, 6, ...) of gravity on inertias J (nodes, 10, ...).  Source: S2 (75)."""
    j, g = unpack(J), tuple(gravity)
    return pack(cross(j[1:4], g) + scale(g, j[0]))


def node_owner(system: System):
    """Carrier of every frame, for wrenches on nodes."""
    return np.asarray(system.topology.frame_node), system.topology.nodes.size


def body_owner(system: System):
    """Carrier of every frame, for wrenches on bodies."""
    return np.asarray(system.topology.frame_body), system.topology.bodies.size


def element_flows(system: System, group, at: Configuration, V, u):
    """What the elements of a group see, their displacements, and flows (n, size) at node twists V, velocities u."""
    seen = group.port.gather(group, at, frame_twists(system, V), u)
    return seen, jax.vmap(group.port.displacement)(*seen), jax.vmap(group.port.flow)(*seen)


def element_efforts(group, displacement, flow, t):
    """Efforts (n, size) of a group's elements on the system."""
    return jax.vmap(lambda law, x, f: group.port.effort(law, x, f, t))(group.law, displacement, flow)


def efforts(system: System, at: Moving, owner=None):
    """All force elements: wrench on every node (nodes, 6), or body by `owner`; effort on every column (nv,); powers.

    The power is what an element feeds in beside the energy it stores: negative for dissipation, positive for
    sources that drive; in the order of `element_names`.  Gravity is not included.
    """
    owner = owner or node_owner(system)
    F, Q, powers = jnp.zeros((owner[1], 6), at.psi.dtype), jnp.zeros_like(at.u), []
    for group in system.forces:
        port = group.port
        seen, displacement, flow = element_flows(system, group, at, at.V, at.u)
        effort = element_efforts(group, displacement, flow, at.t)
        wrenches, columns = port.spread(group, seen, effort, owner, at.u.size)
        F, Q = F if wrenches is None else F + wrenches, Q if columns is None else Q + columns
        storing = jax.vmap(lambda law, x, f, port=port: port.storing(law, x, f, at.t))(group.law, displacement, flow)
        powers.append(jnp.sum(effort * flow, axis=1) + storing)
    if system.elastic:
        loads, power = elastic_efforts(system, at, owner)
        F, Q = F + loads.wrench, Q + loads.column
        powers.append(power)
    return F, Q, jnp.concatenate(powers) if powers else jnp.zeros(0, at.psi.dtype)


def element_names(system: System) -> tuple[str, ...]:
    """Names of the force elements in the order of their powers, then of the elastic bodies (their dampers)."""
    return tuple(name for group in (*system.forces, *system.elastic) for name in group.names)


def element_is_source(system: System) -> tuple[bool, ...]:
    """Whether the power of each element counts as input (else as dissipation)."""
    elastic = (False,) * sum(len(group.names) for group in system.elastic)
    return tuple(group.law.is_source for group in system.forces for _ in group.names) + elastic


def stored_energy(system: System, at: Configuration):
    """Potential energy [J] of all force elements and elastic bodies, without gravity.  Source: S2 (70), V."""
    total, still = strain_energy(system, at), resting(system, at)
    for group in system.forces:
        displacement = element_flows(system, group, at, still.V, still.u)[1]
        parts = jax.vmap(lambda law, x, port=group.port: port.potential(law, x, at.t))(group.law, displacement)
        total = total + jnp.sum(parts)
    return total
