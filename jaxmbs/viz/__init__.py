"""Pictures by matplotlib (extra `viz`), each drawn into `ax` and never shown; bond graphs as SVG text."""

from ..bondgraph.drawing import draw_bond_graph as draw_bond_graph
from .limits import plot_limit_values as plot_limit_values
from .mechanism import plot_mechanism as plot_mechanism
from .plots import plot_coordinates as plot_coordinates
from .plots import plot_energy as plot_energy
from .plots import plot_reactions as plot_reactions
from .power import plot_power as plot_power
