"""The bond graph of a mechanism: its three views, causality, powers, and the state equations read off it."""

from .causality import bond_graph as bond_graph
from .equations import state_equations as state_equations
from .power import bond_powers as bond_powers
from .power import junction_residual as junction_residual
