"""Components joined: bonds, networks, the loads of their bonds, and limits of these."""

from ._base_excitation import BaseMotion, base_motion
from ._blocks import Components, CoupledResponse, coupled_response, interface_pattern
from ._bonds import Bond, bushing, hinge, rigid
from ._connect import connect
from ._limits import (
    ModalPairs,
    combine_modal_maxima,
    cqc_correlation,
    equivalent_impulse,
    limit_loads,
    modal_pairs,
    peak_response,
    truncation_shortfall,
)
from ._loads import BondLoad, BondLoads, Determinacy
from ._measured import MeasuredNetwork
from ._network import Network, reactions
from ._rigid_body import RigidBody

__all__ = [
    "BaseMotion",
    "Bond",
    "BondLoad",
    "BondLoads",
    "Components",
    "CoupledResponse",
    "Determinacy",
    "MeasuredNetwork",
    "ModalPairs",
    "Network",
    "RigidBody",
    "base_motion",
    "bushing",
    "combine_modal_maxima",
    "connect",
    "coupled_response",
    "cqc_correlation",
    "equivalent_impulse",
    "hinge",
    "interface_pattern",
    "limit_loads",
    "modal_pairs",
    "peak_response",
    "reactions",
    "rigid",
    "truncation_shortfall",
]
