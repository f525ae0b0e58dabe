"""Pictures by matplotlib (extra `viz`), each drawn into `ax` and never shown; bond graphs as SVG text."""

from ..bondgraph.drawing import draw_bond_graph
from .limits import plot_limit_values
from .mechanism import plot_mechanism
from .plots import plot_coordinates, plot_energy, plot_history, plot_reactions
from .power import plot_power

__all__ = [
    "draw_bond_graph",
    "plot_coordinates",
    "plot_energy",
    "plot_history",
    "plot_limit_values",
    "plot_mechanism",
    "plot_power",
    "plot_reactions",
]
