"""Elastic bodies in mechanisms: substructures in a floating frame, and the way back to their elements."""

from .carried import carried_loads, mass_properties
from .floating import FloatingFrame, floating_frame
from .recovery import deformations, displacements, interface_loads
from .spin import stiffening

__all__ = [
    "FloatingFrame",
    "carried_loads",
    "deformations",
    "displacements",
    "floating_frame",
    "interface_loads",
    "mass_properties",
    "stiffening",
]
