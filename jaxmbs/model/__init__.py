"""The model: static topology, array parameters, inertia helpers."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
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

import_when_asked(__name__, explain_arguments)
