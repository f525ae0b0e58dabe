"""The bond graph of a mechanism: its three views, causality, powers, and the state equations read off it."""

from ..arguments import explain_arguments
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

explain_arguments(globals())
