"""Pictures: scenes in three dimensions for a browser; by matplotlib (extra `viz`) films, and plots drawn into `ax`
and never shown; bond graphs as SVG text."""

from ..bondgraph.drawing import draw_bond_graph
from .designs import plot_front, plot_limits, plot_parallel, plot_scatter
from .envelopes import plot_envelope, plot_polar
from .films import animate
from .limits import plot_limit_values
from .mechanism import plot_mechanism, plot_views
from .page import Scene, scene
from .plots import plot_coordinates, plot_energy, plot_history, plot_reactions
from .power import plot_power
from .responses import plot_bode, plot_campbell, plot_mac, plot_nyquist
from .solids import Solid
from .structure import plot_modes, plot_structure
from .swinging import Swing, swing

__all__ = [
    "Scene",
    "Solid",
    "Swing",
    "animate",
    "draw_bond_graph",
    "plot_bode",
    "plot_campbell",
    "plot_coordinates",
    "plot_energy",
    "plot_envelope",
    "plot_front",
    "plot_history",
    "plot_limit_values",
    "plot_limits",
    "plot_mac",
    "plot_mechanism",
    "plot_modes",
    "plot_nyquist",
    "plot_parallel",
    "plot_polar",
    "plot_power",
    "plot_reactions",
    "plot_scatter",
    "plot_structure",
    "plot_views",
    "scene",
    "swing",
]
