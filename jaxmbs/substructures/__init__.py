"""Substructures: components reduced to their interfaces, coupled, and the reactions between them."""

from .accuracy import force_errors, frequency_errors, num_modes_up_to
from .base import Reduced, partition, physical, reduce
from .base_motion import BaseMotion, base_motion
from .bonds import Bond, bushing, joint, rigid
from .characteristic import characteristic, characteristic_modes
from .coupling import Assembly, Reactions, elastic_bond, interface_reactions, join
from .craig_bampton import craig_bampton, fixed_interface_modes
from .craig_chang import craig_chang
from .dual import dual_response, redundancy
from .guyan import constraint_modes, guyan, interface_basis
from .hurty import determinate_coordinates, hurty, rigid_motions
from .interface import Components, CoupledResponse, couple, interface_pattern
from .large import large_craig_bampton
from .limits import ModalPairs, limit_loads, modal_pairs, shortfall
from .macneal import macneal
from .mixed import mixed
from .modal_transient import modal_transient
from .network import BondForces, Determinacy, Network, connect
from .recovery import (
    element_loads,
    harmonic,
    interface_forces,
    mode_acceleration,
    mode_acceleration_free,
    mode_displacement,
)
from .rigid_interface import (
    averaged_motion,
    averaged_transformation,
    on_interface,
    rigid_body_motions,
    rigid_node,
    rigid_transformation,
)
from .rubin import rubin
from .sparse import craig_bampton_sparse
from .stacked import stacked
from .transient import Link, Transient, transient
