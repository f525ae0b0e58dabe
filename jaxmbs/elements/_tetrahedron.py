"""Tetrahedra of four and of ten nodes."""

import numpy as np

from ._shape_functions import ShapeFunctions, middles, simplex_exponents, simplex_points
from ._solid import AbstractSolid, SolidRule

_CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
#: Nodes of the four faces, counter-clockwise seen from outside: opposite to the nodes 3, 2, 0, 1.
_FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
_CENTRE = np.full((1, 3), 0.25)
_INNER = (5.0 - 5.0**0.5) / 20.0  # four points, exact to the second degree
_POINTS = _INNER + (1.0 - 4.0 * _INNER) * np.array(_CORNERS)


class Tetrahedron(AbstractSolid):
    """Tetrahedron of four nodes, of constant strain: stiff in bending, for what is far from where it matters.

    Stresses [Pa] in world axes, tension positive; its forces are the same numbers.
    Seen from node 3, nodes 0-2 are counter-clockwise.
    Source: Zienkiewicz and Taylor, The finite element method (2000), vol. 1, 6.

    Attributes:
        young: modulus [Pa]; poisson; density [kg/m^3].
        moduli: (6, 6) elasticity [Pa] of an anisotropic material in world axes, instead of young and poisson.
    """

    num_nodes = 4
    rule = SolidRule(
        ShapeFunctions(simplex_exponents(1, 3), _CORNERS),
        *(_CENTRE, np.array([1 / 6]), _POINTS, np.full(4, 1 / 24), _CENTRE, 4, (), _FACES),
    )


class QuadraticTetrahedron(AbstractSolid):
    """Tetrahedron of ten nodes, whose edges and faces may be curved.

    Stresses [Pa] at the centre, world axes, tension positive; its forces are the same numbers.
    Nodes 0-3 as those of `Tetrahedron`; 4-9 are the middles of the edges 01, 12, 20, 03, 13, 23.
    Source: Zienkiewicz and Taylor, The finite element method (2000), vol. 1, 8.

    Attributes:
        young: modulus [Pa]; poisson; density [kg/m^3].
        moduli: (6, 6) elasticity [Pa] of an anisotropic material in world axes, instead of young and poisson.
    """

    num_nodes = 10
    rule = SolidRule(
        ShapeFunctions(simplex_exponents(2, 3), middles(_CORNERS, _EDGES)),
        *(_POINTS, np.full(4, 1 / 24), *simplex_points(4, 3), _CENTRE, 4, _EDGES, _FACES),
    )
