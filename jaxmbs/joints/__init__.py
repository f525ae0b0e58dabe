"""Joints, one per file.  A new joint is a file here and a line below; the tests over all joints take it in."""

from .base import AbstractJoint as AbstractJoint
from .closures import AbstractClosure as AbstractClosure
from .closures import Coupler as Coupler
from .closures import Distance as Distance
from .closures import PointOnLine as PointOnLine
from .closures import PointOnPlane as PointOnPlane
from .closures import Rows as Rows
from .closures import VelocityRows as VelocityRows
from .cylindrical import Cylindrical as Cylindrical
from .frame_path import FramePath as FramePath
from .free import Free as Free
from .modal import Modal as Modal
from .planar import Planar as Planar
from .prismatic import Prismatic as Prismatic
from .revolute import Revolute as Revolute
from .rolling import KnifeEdge as KnifeEdge
from .rolling import RollingDisk as RollingDisk
from .rolling import RollingSphere as RollingSphere
from .screw import Screw as Screw
from .spherical import Spherical as Spherical
from .universal import Universal as Universal
from .weld import Weld as Weld

ALL = (Revolute, Prismatic, Cylindrical, Screw, Universal, Spherical, Planar, Free, Weld)

__all__ = [
    "AbstractClosure",
    "AbstractJoint",
    "Coupler",
    "Cylindrical",
    "Distance",
    "FramePath",
    "Free",
    "KnifeEdge",
    "Planar",
    "PointOnLine",
    "PointOnPlane",
    "Prismatic",
    "Revolute",
    "RollingDisk",
    "RollingSphere",
    "Rows",
    "Screw",
    "Spherical",
    "Universal",
    "VelocityRows",
    "Weld",
]
