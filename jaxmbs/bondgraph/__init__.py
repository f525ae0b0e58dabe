"""The bond graph of a mechanism: its three views, causality, powers, and the state equations read off it."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._causality import bond_graph
    from ._element_powers import element_powers
    from ._equations import graph_state_equations
    from ._power import bond_powers, junction_residual

__all__ = [
    "bond_graph",
    "bond_powers",
    "element_powers",
    "graph_state_equations",
    "junction_residual",
]

import_when_asked(__name__, explain_arguments)
