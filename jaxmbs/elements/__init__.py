"""Finite elements, one per file.  A new element is a file here and a line below; the tests over all take it in."""

from .base import DIRECTIONS as DIRECTIONS
from .base import AbstractElement as AbstractElement
from .beam import Beam as Beam
from .hexahedron import Hexahedron as Hexahedron
from .point_mass import PointMass as PointMass
from .quadrilateral import Quadrilateral as Quadrilateral
from .rod import Rod as Rod
from .spring import GroundSpring as GroundSpring
from .spring import Spring as Spring
from .triangle import Triangle as Triangle

ALL = (PointMass, Spring, GroundSpring, Rod, Beam, Triangle, Quadrilateral, Hexahedron)

__all__ = [
    "AbstractElement",
    "Beam",
    "DIRECTIONS",
    "GroundSpring",
    "Hexahedron",
    "PointMass",
    "Quadrilateral",
    "Rod",
    "Spring",
    "Triangle",
]
