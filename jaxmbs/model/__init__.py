"""The model: static topology, array parameters, inertia helpers."""

from ..arguments import explain_arguments
from . import inertia, rotations
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

for _room in (globals(), vars(inertia), vars(rotations)):
    explain_arguments(_room)
