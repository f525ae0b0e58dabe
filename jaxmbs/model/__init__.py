"""The model: static topology, array parameters, inertia helpers."""

from .frame import Pose as Pose
from .system import System as System
from .topology import Topology as Topology
