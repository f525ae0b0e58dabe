"""Components joined: bonds, networks, the loads of their bonds, and limits of these."""

from .blocks import Components, CoupledResponse, coupled_response, interface_pattern
from .bonds import Bond, bushing, joint, rigid
from .connecting import connect
from .limits import (
    ModalPairs,
    combine,
    cqc_correlation,
    equivalent_impulse,
    limit_loads,
    modal_pairs,
    peak_response,
    shortfall,
)
from .loads import BondLoad, BondLoads, Determinacy
from .measured import MeasuredNetwork
from .moved_base import BaseMotion, base_motion
from .network import Network, reactions
from .rigid_body import RigidBody

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
    "combine",
    "connect",
    "coupled_response",
    "cqc_correlation",
    "equivalent_impulse",
    "interface_pattern",
    "joint",
    "limit_loads",
    "modal_pairs",
    "peak_response",
    "reactions",
    "rigid",
    "shortfall",
]
