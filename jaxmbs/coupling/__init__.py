"""Components joined: bonds, networks, the reactions between them, their motion and its limits."""

from .base_motion import BaseMotion, base_motion
from .blocks import Components, CoupledResponse, couple, interface_pattern
from .bonds import Bond, bushing, joint, rigid
from .dual import dual_response, redundancy
from .limits import (
    ModalPairs,
    cqc_correlation,
    equivalent_impulse,
    limit_loads,
    modal_pairs,
    peak_response,
    shortfall,
)
from .modal_transient import modal_transient
from .network import BondForces, Determinacy, Network, connect
from .primal import Assembly, Reactions, elastic_bond, interface_reactions, join
from .stacked import stacked
from .transient import Link, Transient, transient

__all__ = [
    "Assembly",
    "BaseMotion",
    "Bond",
    "BondForces",
    "Components",
    "CoupledResponse",
    "Determinacy",
    "Link",
    "ModalPairs",
    "Network",
    "Reactions",
    "Transient",
    "base_motion",
    "bushing",
    "connect",
    "couple",
    "cqc_correlation",
    "dual_response",
    "elastic_bond",
    "equivalent_impulse",
    "interface_pattern",
    "interface_reactions",
    "join",
    "joint",
    "limit_loads",
    "modal_pairs",
    "modal_transient",
    "peak_response",
    "redundancy",
    "rigid",
    "shortfall",
    "stacked",
    "transient",
]
