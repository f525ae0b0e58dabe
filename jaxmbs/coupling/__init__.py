"""Coupling of components: bonds, networks, the loads of bonds and their limits, coupling by transfer functions."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._base_excitation import BaseMotion, base_motion
    from ._block_assembly import Components, CoupledResponse, coupled_response, interface_pattern
    from ._bond_loads import BondLoad, BondLoads, Determinacy
    from ._bonds import Bond, bushing, hinge, rigid_bond
    from ._connect import connect
    from ._limit_loads import (
        ModalPairs,
        combine_modal_maxima,
        cqc_correlation,
        equivalent_impulse,
        limit_loads,
        modal_pairs,
        peak_response,
        truncation_shortfall,
    )
    from ._measured_network import MeasuredNetwork
    from ._network import ComponentNetwork, reactions
    from ._regularised_inverse import regularised_inverse
    from ._rigid_body import RigidBody
    from ._transfer_functions import couple_transfer, coupling_forces
    from ._uncoupled_transfer import uncoupled_transfer

__all__ = [
    "BaseMotion",
    "Bond",
    "BondLoad",
    "BondLoads",
    "ComponentNetwork",
    "Components",
    "CoupledResponse",
    "Determinacy",
    "MeasuredNetwork",
    "ModalPairs",
    "RigidBody",
    "base_motion",
    "bushing",
    "combine_modal_maxima",
    "connect",
    "couple_transfer",
    "coupled_response",
    "coupling_forces",
    "cqc_correlation",
    "equivalent_impulse",
    "hinge",
    "interface_pattern",
    "limit_loads",
    "modal_pairs",
    "peak_response",
    "reactions",
    "regularised_inverse",
    "rigid_bond",
    "truncation_shortfall",
    "uncoupled_transfer",
]

import_when_asked(__name__, explain_arguments)
