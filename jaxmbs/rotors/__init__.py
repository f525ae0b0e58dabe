"""Rotors on bearings: whirl and critical speeds, response to unbalance, orbits, margins."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._critical import CriticalSpeeds, critical_speed_map, critical_speeds
    from ._parts import Bearing, BearingTable, Disk
    from ._plain_bearing import PlainBearing
    from ._resonance import Resonance, resonance, separation_margin
    from ._rotor import Rotor
    from ._run_up import RunUp, run_up
    from ._shaft import Shaft
    from ._unbalance import Orbit, UnbalanceResponse, unbalance_response
    from ._validity import BearingValidity
    from ._whirl import WhirlSpeeds, whirl_speeds

__all__ = [
    "Bearing",
    "BearingTable",
    "BearingValidity",
    "CriticalSpeeds",
    "Disk",
    "Orbit",
    "PlainBearing",
    "Resonance",
    "Rotor",
    "RunUp",
    "Shaft",
    "UnbalanceResponse",
    "WhirlSpeeds",
    "critical_speed_map",
    "critical_speeds",
    "resonance",
    "run_up",
    "separation_margin",
    "unbalance_response",
    "whirl_speeds",
]

import_when_asked(__name__, explain_arguments)
