"""Joints, one per file.  A new joint is a file here, a line below and one in `_all.py`; all tests take it in."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._all import ALL as ALL
    from ._base import AbstractJoint as AbstractJoint
    from ._base import Node as Node
    from ._base import parallel_rows as parallel_rows
    from ._closures import AbstractClosure as AbstractClosure
    from ._closures import Coupler as Coupler
    from ._closures import Distance as Distance
    from ._closures import PointOnLine as PointOnLine
    from ._closures import PointOnPlane as PointOnPlane
    from ._closures import PositionRows as PositionRows
    from ._closures import VelocityRows as VelocityRows
    from ._cylindrical import Cylindrical as Cylindrical
    from ._frame_path import FramePath as FramePath
    from ._free import Free as Free
    from ._modal import Modal as Modal
    from ._planar import Planar as Planar
    from ._prismatic import Prismatic as Prismatic
    from ._revolute import Revolute as Revolute
    from ._rolling import KnifeEdge as KnifeEdge
    from ._rolling import RollingDisk as RollingDisk
    from ._rolling import RollingSphere as RollingSphere
    from ._rows import AbstractRows as AbstractRows
    from ._screw import Screw as Screw
    from ._spherical import Spherical as Spherical
    from ._universal import Universal as Universal
    from ._weld import Weld as Weld

__all__ = [
    "AbstractClosure",
    "AbstractJoint",
    "AbstractRows",
    "Coupler",
    "Cylindrical",
    "Distance",
    "FramePath",
    "Free",
    "KnifeEdge",
    "Node",
    "Planar",
    "PointOnLine",
    "PointOnPlane",
    "PositionRows",
    "Prismatic",
    "Revolute",
    "RollingDisk",
    "RollingSphere",
    "Screw",
    "Spherical",
    "Universal",
    "VelocityRows",
    "Weld",
    "parallel_rows",
]

import_when_asked(__name__, explain_arguments)
