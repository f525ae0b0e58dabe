"""All finite elements of the library, for what is asked of each kind."""

from ._beam import Beam
from ._hexahedron import Hexahedron
from ._point_mass import PointMass
from ._quadrilateral import Quadrilateral
from ._rod import Rod
from ._spring import GroundSpring, Spring
from ._triangle import Triangle

ALL = (PointMass, Spring, GroundSpring, Rod, Beam, Triangle, Quadrilateral, Hexahedron)
