"""The model: static topology, array parameters, inertia helpers."""

from ._pose import Pose
from ._system import System
from ._topology import Topology

__all__ = [
    "Pose",
    "System",
    "Topology",
]
