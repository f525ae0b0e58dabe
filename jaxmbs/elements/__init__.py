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
    from ._hexahedron import QuadraticHexahedron as QuadraticHexahedron
    from ._laminate import Laminate as Laminate
    from ._laminate import hill_reserve as hill_reserve
    from ._laminate import orthotropic as orthotropic
    from ._laminate import tsai_wu_reserve as tsai_wu_reserve
    from ._point_mass import PointMass as PointMass
    from ._quadratic_shell import QuadraticQuadrilateral as QuadraticQuadrilateral
    from ._quadratic_shell import QuadraticTriangle as QuadraticTriangle
    from ._quadrilateral import LayeredQuadrilateral as LayeredQuadrilateral
    from ._quadrilateral import Quadrilateral as Quadrilateral
    from ._rod import Rod as Rod
    from ._shear_panel import ShearPanel as ShearPanel
    from ._shell_section import ShellSection as ShellSection
    from ._spring import GroundSpring as GroundSpring
    from ._spring import Spring as Spring
    from ._tetrahedron import QuadraticTetrahedron as QuadraticTetrahedron
    from ._tetrahedron import Tetrahedron as Tetrahedron
    from ._triangle import LayeredTriangle as LayeredTriangle
    from ._triangle import Triangle as Triangle
    from ._wedge import QuadraticWedge as QuadraticWedge
    from ._wedge import Wedge as Wedge

__all__ = [
    "AbstractElement",
    "Beam",
    "DIRECTIONS",
    "GroundSpring",
    "Hexahedron",
    "Laminate",
    "LayeredQuadrilateral",
    "LayeredTriangle",
    "PointMass",
    "QuadraticHexahedron",
    "QuadraticQuadrilateral",
    "QuadraticTetrahedron",
    "QuadraticTriangle",
    "QuadraticWedge",
    "Quadrilateral",
    "Rod",
    "ShearPanel",
    "ShellSection",
    "Spring",
    "Tetrahedron",
    "Triangle",
    "Wedge",
    "hill_reserve",
    "orthotropic",
    "tsai_wu_reserve",
]

import_when_asked(__name__, explain_arguments)
