"""All finite elements of the library, for what is asked of each kind."""

from ._beam import Beam
from ._hexahedron import Hexahedron, QuadraticHexahedron
from ._point_mass import PointMass
from ._quadratic_shell import QuadraticQuadrilateral, QuadraticTriangle
from ._quadrilateral import LayeredQuadrilateral, Quadrilateral
from ._rod import Rod
from ._shear_panel import ShearPanel
from ._spring import GroundSpring, Spring
from ._tetrahedron import QuadraticTetrahedron, Tetrahedron
from ._triangle import LayeredTriangle, Triangle
from ._wedge import QuadraticWedge, Wedge

ALL = (
    *(PointMass, Spring, GroundSpring, Rod, Beam),
    *(Triangle, Quadrilateral, LayeredTriangle, LayeredQuadrilateral, ShearPanel),
    *(QuadraticTriangle, QuadraticQuadrilateral),
    *(Tetrahedron, Wedge, Hexahedron, QuadraticTetrahedron, QuadraticWedge, QuadraticHexahedron),
)
