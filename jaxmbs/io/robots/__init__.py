"""Mechanisms from the files that robots are described in."""

from ._imported import Imported, JointLimits
from ._mjcf import read_mjcf
from ._sdf import read_sdf
from ._urdf import read_urdf

__all__ = ["Imported", "JointLimits", "read_mjcf", "read_sdf", "read_urdf"]
