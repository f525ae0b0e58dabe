"""Displacements and flows of force elements at their ports."""

import jax

from ..model._system import System
from ._configuration import Configuration
from ._poses import frame_twists


def element_flows(system: System, group, at: Configuration, V, u):
    """Inputs of the ports of a group (see `AbstractPort.gather`), their displacements, and their flows (n, size), at
    node twists V and velocities u."""
    seen = group.port.gather(group, at, frame_twists(system, V), u)
    return seen, jax.vmap(group.port.displacement)(*seen), jax.vmap(group.port.flow)(*seen)
