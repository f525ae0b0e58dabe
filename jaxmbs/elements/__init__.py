"""Finite elements, one per file.  A new one is a file here, a line below and one in `_all.py`; tests take it in."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._all import ALL as ALL
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

import_when_asked(__name__, explain_arguments)
