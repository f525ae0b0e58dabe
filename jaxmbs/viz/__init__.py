"""Pictures by matplotlib (extra `viz`): every function draws into `ax`, returns it and never shows it."""

from .mechanism import plot_mechanism as plot_mechanism
from .plots import plot_coordinates as plot_coordinates
from .plots import plot_energy as plot_energy
from .plots import plot_reactions as plot_reactions
