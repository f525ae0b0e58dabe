"""Sums over all bodies of a system, rigid and elastic: momenta, inertial loads, mass."""

import functools
import operator

from jax import Array

from ..kinematics._configuration import VelocityKinematics
from ..kinematics._tree import ancestors
from ..kinematics._wrench_targets import WrenchTargets
from ..math._spatial import scale
from ..model._system import System
from ._body import AbstractBodies
from ._elastic import ElasticBodies
from ._loads import Loads
from ._rigid import RigidBodies

total = functools.partial(functools.reduce, operator.add)


def bodies_of(system: System) -> tuple[AbstractBodies, ...]:
    """The rigid bodies, then the groups of elastic ones."""
    return RigidBodies(), *(ElasticBodies(group) for group in system.elastic)


def body_momenta(system: System, at: VelocityKinematics) -> Loads:
    """Momenta of all bodies on nodes and columns."""
    return total(bodies.momenta(system, at) for bodies in bodies_of(system))


def inertial_loads(system: System, at: VelocityKinematics) -> Loads:
    """Rates of the momenta of all bodies that are due to their motion and to gravity, not to other loads."""
    return total(bodies.inertial_loads(system, at) for bodies in bodies_of(system))


def inverse_dynamics_loads(system: System, at: VelocityKinematics, V_dot, u_dot, owners: WrenchTargets) -> Loads:
    """Loads that the given accelerations of all bodies require beside gravity."""
    return total(bodies.inverse_dynamics_loads(system, at, V_dot, u_dot, owners) for bodies in bodies_of(system))


def acceleration_loads(system: System, at: VelocityKinematics, a, owners: WrenchTargets, V_dot=None) -> Loads:
    """The part of `inverse_dynamics_loads` that is linear in the accelerations a (nv,).

    Args: V_dot: the part of the twist rates (nodes, 6) that is, where it is known.
    """
    V_dot = ancestors(system.topology.nodes, scale(at.S, a)) if V_dot is None else V_dot
    return total(bodies.acceleration_loads(system, at, V_dot, a, owners) for bodies in bodies_of(system))


def total_mass(system: System) -> Array:
    """Mass [kg] of all bodies."""
    return total(bodies.mass(system) for bodies in bodies_of(system))
