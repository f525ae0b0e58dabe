"""Identification: unknowns of a model from measurements, and a verdict on what the measurements can tell."""

from ._identification import Identification
from ._identify import identify
from ._verdict import Direction

__all__ = ["Direction", "Identification", "identify"]
