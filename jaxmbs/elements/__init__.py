"""Finite elements, one per file.  A new element is a file here and a line below; the tests over all take it in."""

from ..arguments import explain_arguments
from ._base import DIRECTIONS as DIRECTIONS
from ._base import AbstractElement as AbstractElement
from ._beam import Beam as Beam
from ._hexahedron import Hexahedron as Hexahedron
from ._point_mass import PointMass as PointMass
from ._quadrilateral import Quadrilateral as Quadrilateral
from ._rod import Rod as Rod
from ._spring import GroundSpring as GroundSpring
from ._spring import Spring as Spring
from ._triangle import Triangle as Triangle

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

explain_arguments(globals())
