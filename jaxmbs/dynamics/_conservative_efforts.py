"""Conservative efforts of force elements and strains, and their other efforts at rest, on all velocity columns."""

from collections.abc import Callable

import jax
import jax.numpy as jnp

from ..kinematics._configuration import Configuration, at_rest
from ..kinematics._element_flows import element_flows
from ..kinematics._wrench_targets import node_targets
from ..model._system import System
from ..signal_flow._acting_laws import acting_laws
from ..signal_flow._signals import with_signals
from ._bodies import bodies_of, total
from ._efforts import element_efforts
from ._loads import Loads, on_columns


def conservative_efforts(system: System, at: Configuration) -> Callable[[Configuration], jax.Array]:
    """Efforts of stored energy at a configuration, frozen: a function from another configuration to the generalised
    efforts (nv,) that the same port efforts exert there.

    At the same configuration it is `-dV/dpsi`; its slope is the effect of the changing geometry at constant efforts.
    Source: S2 (59), (64), (69).
    """
    held, _ = port_efforts(system, at)
    strains = [bodies.frozen_strain_loads(system, at) for bodies in bodies_of(system)]

    def pull(moved):
        return on_columns(
            system, moved, _loads_of_efforts(system, moved, held) + total(strain(moved) for strain in strains)
        )

    return pull


def source_efforts(system: System, at: Configuration):
    """Efforts (nv,) that the elements exert at rest beside their stored energy.  Source: S2 (76), Q*."""
    return on_columns(system, at, _loads_of_efforts(system, at, port_efforts(system, at)[1]))


def port_efforts(system: System, at: Configuration):
    """Port efforts (n, num_flows) of the elements at rest by force group, as a pair: those that derive from the
    potential, and all others."""
    still, stored, other = with_signals(system, at_rest(system, at)), [], []
    for group, law in acting_laws(system, still):
        _, displacement, flow = element_flows(system, group, still, still.V, still.u)
        own = jax.vmap(lambda law, x, f, port=group.port: port.stored_effort(law, x, f, at.t))
        stored.append(own(law, displacement, flow))
        other.append(element_efforts(group, law, displacement, flow, at.t) - stored[-1])
    return stored, other


def _loads_of_efforts(system, at, efforts) -> Loads:
    """Loads on nodes and columns from port efforts of the elements, by force group."""
    still, owners = at_rest(system, at), node_targets(system)
    loads = Loads(jnp.zeros((owners.number, 6), at.psi.dtype))
    for group, effort in zip(system.forces, efforts, strict=True):
        seen, *_ = element_flows(system, group, still, still.V, still.u)
        loads = loads + Loads(*group.port.spread(group, seen, effort, owners, still.u.size))
    return loads
