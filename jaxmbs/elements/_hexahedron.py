"""Eight-node brick with enhanced strains, and the brick of twenty nodes."""

import numpy as np

from ._shape_functions import ShapeFunctions, middles, serendipity_exponents
from ._shared_matrices import gauss_points
from ._solid import AbstractSolid, SolidRule, natural_strains

_CORNERS = [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]
_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 5), (2, 6), (3, 7), (4, 5), (5, 6), (6, 7), (7, 4))
#: Nodes of the six faces, counter-clockwise seen from outside: -x, +x, -y, +y, -z, +z of the cube.
FACES = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))
_POINTS, _WEIGHTS = gauss_points(2, 3)
_ENHANCED = natural_strains(
    _POINTS,
    {
        (0, 0): lambda r: (r[0], r[0] * r[1], r[0] * r[2]),
        (1, 1): lambda r: (r[1], r[1] * r[2], r[1] * r[0]),
        (2, 2): lambda r: (r[2], r[2] * r[0], r[2] * r[1]),
        (0, 1): lambda r: (r[0], r[1], r[0] * r[2], r[1] * r[2]),
        (1, 2): lambda r: (r[1], r[2], r[1] * r[0], r[2] * r[0]),
        (2, 0): lambda r: (r[2], r[0], r[2] * r[1], r[0] * r[1]),
    },
)


class Hexahedron(AbstractSolid):
    """Brick of eight nodes; bends, twists and warps without shear locking and passes the patch test in any shape.

    Stresses [Pa] at the centre, world axes, tension positive; its forces are the same numbers.
    Nodes 0-3 go round one face, 4-7 lie over them; seen from 4-7, 0-3 are counter-clockwise.
    Source: Andelfinger and Ramm, Int. J. Numer. Meth. Eng. 36 (1993) 1311-1337, 21 enhanced strains; of a cube its
    matrix is that of Nastran's CHEXA.

    Attributes:
        young: modulus [Pa]; poisson; density [kg/m^3].
        moduli: (6, 6) elasticity [Pa] of an anisotropic material in world axes, instead of young and poisson.
    """

    num_nodes = 8
    rule = SolidRule(
        ShapeFunctions(serendipity_exponents(1, 3), _CORNERS),
        *(_POINTS, _WEIGHTS, _POINTS, _WEIGHTS, np.zeros((1, 3)), 8, (), FACES, _ENHANCED),
    )


class QuadraticHexahedron(AbstractSolid):
    """Brick of twenty nodes, whose edges and faces may be curved.

    Stresses [Pa] at the centre, world axes, tension positive; its forces are the same numbers.
    Nodes 0-7 as those of `Hexahedron`; 8-11 are the middles of the edges round the first face, 12-15 of those between
    the two, 16-19 of those round the second.
    Source: Zienkiewicz and Taylor, The finite element method (2000), vol. 1, 8.

    Attributes:
        young: modulus [Pa]; poisson; density [kg/m^3].
        moduli: (6, 6) elasticity [Pa] of an anisotropic material in world axes, instead of young and poisson.
    """

    num_nodes = 20
    rule = SolidRule(
        ShapeFunctions(serendipity_exponents(2, 3), middles(_CORNERS, _EDGES)),
        *(*gauss_points(3, 3), *gauss_points(3, 3), np.zeros((1, 3)), 8, _EDGES, FACES),
    )
