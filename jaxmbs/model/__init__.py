"""The model: static topology, array parameters, inertia helpers."""

from .frame import Pose
from .system import System
from .topology import Topology

__all__ = [
    "Pose",
    "System",
    "Topology",
]
