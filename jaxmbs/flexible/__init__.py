"""Elastic bodies in mechanisms: substructures in a floating frame, and the way back to their elements."""

from .carried import carried_loads as carried_loads
from .carried import mass_properties as mass_properties
from .floating_frame import FloatingFrame as FloatingFrame
from .floating_frame import floating_frame as floating_frame
from .recovery import deformations as deformations
from .recovery import displacements as displacements
from .recovery import interface_loads as interface_loads
