"""Mechanisms from the files that robots are described in."""

from .imported import Imported, JointLimits
from .mjcf import read_mjcf
from .urdf import read_urdf

__all__ = ["Imported", "JointLimits", "read_mjcf", "read_urdf"]
