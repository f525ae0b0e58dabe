"""Pictures: 3-D scenes for a browser, plots and animations by matplotlib (extra `viz`), bond graphs as SVG.

Plots are drawn into `ax` and never shown.
"""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ..bondgraph._drawing import draw_bond_graph
    from ._animation import animate
    from ._branches import plot_branches
    from ._designs import plot_importances, plot_limits, plot_parallel, plot_pareto_front, plot_scatter
    from ._envelopes import plot_envelope, plot_polar
    from ._limits import plot_limit_values
    from ._mechanism import plot_mechanism, plot_views
    from ._mode_animation import ModeAnimation, animate_mode
    from ._orbits import plot_orbits
    from ._plots import plot_coordinates, plot_energy, plot_history, plot_reactions
    from ._power import plot_element_power, plot_power
    from ._qualification import (
        plot_margins,
        plot_notches,
        plot_psd,
        plot_rainflow_matrix,
        plot_shock_spectrum,
        plot_sn,
    )
    from ._responses import plot_bode, plot_campbell, plot_mac, plot_nyquist
    from ._structure import plot_modes, plot_structure
    from .scenes._page import Scene, scene
    from .scenes._solids import Solid

__all__ = [
    "ModeAnimation",
    "Scene",
    "Solid",
    "animate",
    "animate_mode",
    "draw_bond_graph",
    "plot_bode",
    "plot_branches",
    "plot_campbell",
    "plot_coordinates",
    "plot_energy",
    "plot_element_power",
    "plot_envelope",
    "plot_history",
    "plot_importances",
    "plot_limit_values",
    "plot_limits",
    "plot_mac",
    "plot_margins",
    "plot_mechanism",
    "plot_modes",
    "plot_notches",
    "plot_nyquist",
    "plot_orbits",
    "plot_parallel",
    "plot_pareto_front",
    "plot_polar",
    "plot_power",
    "plot_psd",
    "plot_rainflow_matrix",
    "plot_reactions",
    "plot_scatter",
    "plot_shock_spectrum",
    "plot_sn",
    "plot_structure",
    "plot_views",
    "scene",
]

import_when_asked(__name__, explain_arguments)
