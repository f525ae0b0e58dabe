"""A system at a state as a network of bonds: for the matrix, the family and the redundancy of its reactions."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..kinematics import constraints
from ..kinematics.poses import geometry, node_parameters
from ..kinematics.state import State
from ..model.system import System
from ..statics import Bonds
from ..statics.bonds import about
from ..statics.tree import on_bodies
from .distribution import system_bonds
from .reactions import reactions


@eqx.filter_jit
def reaction_bonds(system: System, state: State, compliance=None) -> tuple[Bonds, jnp.ndarray]:
    """The bonds of a system at a state, and the loads (bodies, 6) that they supply to the bodies there.

    Bonds are the joints and two-frame constraints, at their frame on the child; drives are part of their joints.
    Springs, motors and couplers inside joints stand as efforts. `statics.bond_reactions(*reaction_bonds(...))`
    equals `reactions`; `statics.reaction_matrix`, `reaction_family` and `redundancy` take the same bonds.

    Args: compliance: as in `reactions`.  Source: S1 (26)-(29).
    """
    found = reactions(system, state, compliance=compliance)
    geo = geometry(system, node_parameters(system), state.coordinates)
    names, _, at = zip(*constraints.carriers(system), strict=True)
    at = np.array(at)
    force, moment = (jnp.stack([getattr(found[name], part) for name in names]) for part in ("force", "moment"))
    wrench = about(jnp.concatenate([moment, force], axis=1), -geo.x[at])
    bonds = system_bonds(system, geo, wrench, compliance)
    analysis = system.topology.analysis
    marks = analysis.undetermined if analysis else tuple((False,) * 6 for _ in at)
    return dataclasses.replace(bonds, undetermined=marks), on_bodies(bonds.network, wrench)
