"""A mechanism at a state as a network of bonds, for the functions of `statics` on its reactions."""

import dataclasses
from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np

from ..assembly._state import HasStates, State
from ..checks import is_concrete
from ..constraints import _reaction_map as reaction_map
from ..dynamics._distribution import system_bonds
from ..kinematics._configuration import configuration
from ..kinematics._poses import node_parameters
from ..model._changes import with_changes
from ..model._entry_points import states_of
from ..model._system import System
from ..runtime import jit
from ..statics import Bonds
from ..statics._bonds import shift_wrench
from ..statics._network_sums import body_wrenches
from ._solve import reactions


def reaction_bonds(
    system: System, motion: State | HasStates, compliance: Mapping | None = None, method: str = "auto"
) -> tuple[Bonds, jnp.ndarray]:
    """The bonds of a system, and the loads (..., bodies, 6) that they supply to the bodies, at a state or motion.

    Bonds are the joints and two-frame constraints, at their frame on the child; drives are part of their joints.
    Springs, motors and couplers inside joints are efforts. `statics.bond_reactions(*reaction_bonds(...))`
    equals `reactions`; `statics.reaction_matrix`, `reaction_family` and `redundancy` take the same bonds.

    The bonds are marked by what statics leaves open at that pose, along a motion at any of its instants; within a
    trace they are not marked (`statics.with_redundancy`).

    Args: motion, compliance, method: as in `reactions`.  Along a motion every array has the times in front:
        `jax.vmap(statics.bond_reactions)(bonds, loads)`.

    Raises: ValueError for an unknown method or name.  Source: S1 (26)-(29).
    """
    states = states_of(system, motion)
    found = reactions(system, states, frame="joint", compliance=compliance, method=method)
    marks = _undetermined_components(system, found)
    return _bonds_and_loads(system, states, found, compliance, states.coordinates.ndim == 2, marks)


def _undetermined_components(system, found):
    """Undetermined components by bond, from reactions in joint axes; None within a trace."""
    loads = [found[name] for name, *_ in reaction_map.reaction_carriers(system)]
    if not is_concrete(loads):
        return None
    unique = [np.concatenate([load.unique_force, load.unique_moment], axis=-1).reshape(-1, 6) for load in loads]
    return tuple(tuple((~row.all(axis=0)).tolist()) for row in unique)


@jit
def _bonds_and_loads(system, states, found, compliance, batched, marks):
    names, _, own = zip(*reaction_map.reaction_carriers(system), strict=True)
    own = np.array(own)

    def one(state, found):
        here = with_changes(system, state)
        P, world = node_parameters(here), jnp.zeros(3, state.coordinates.dtype)
        at = configuration(here, P, state.coordinates, state.t, inertias=False, origin=world)
        force, moment = (jnp.stack([getattr(found[name], part) for name in names]) for part in ("force", "moment"))
        force, moment = (jnp.einsum("qij,qj->qi", at.R[own], part) for part in (force, moment))
        wrench = shift_wrench(jnp.concatenate([force, moment], axis=1), -at.x[own])
        bonds = system_bonds(here, at, wrench, compliance)
        return dataclasses.replace(bonds, undetermined=marks), body_wrenches(bonds.network, wrench)

    return jax.vmap(one)(states, found) if batched else one(states, found)
