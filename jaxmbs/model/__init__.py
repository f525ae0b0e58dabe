"""The model: static topology, array parameters, inertia helpers."""

from ._internal_states import InternalStates
from ._pose import Pose
from ._system import System
from ._topology import Topology

__all__ = [
    "InternalStates",
    "Pose",
    "System",
    "Topology",
]
