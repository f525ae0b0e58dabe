"""Motions in time."""

from .integrate import simulate as simulate
from .motion import Motion as Motion
from .solvers import SemiImplicitEuler as SemiImplicitEuler
