"""Assembly of mechanisms: states that close all loops, their search, and the branches on which they are closed."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._state import State
    from ._state_sweep import branch, states_along

__all__ = [
    "State",
    "branch",
    "states_along",
]

import_when_asked(__name__, explain_arguments)
