"""Wedges (triangular prisms) of six and of fifteen nodes."""

import numpy as np

from ._shape_functions import ShapeFunctions, middles, simplex_exponents, simplex_points
from ._shared_matrices import gauss_points
from ._solid import AbstractSolid, SolidRule

_CORNERS = [(0, 0, -1), (1, 0, -1), (0, 1, -1), (0, 0, 1), (1, 0, 1), (0, 1, 1)]
_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 4), (2, 5), (3, 4), (4, 5), (5, 3))
#: Nodes of the five faces, counter-clockwise seen from outside: the triangles, then the sides over 01, 12, 20.
_FACES = ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))
_CENTRE = np.array([[1 / 3, 1 / 3, 0.0]])
_TRIANGLE = np.array([[1 / 6, 1 / 6], [2 / 3, 1 / 6], [1 / 6, 2 / 3]]), np.full(3, 1 / 6)


def _product(plane, along):
    """Points and weights of a triangle times those of a line."""
    points = [[*p, *z] for z in along[0] for p in plane[0]]
    return np.array(points), np.outer(along[1], plane[1]).ravel()


def _exponents(order):
    """Monomials of a triangle times 1 and t, and for order 2 linear ones times t^2."""
    parts = [(simplex_exponents(order, 2), (0, 1)), *([(simplex_exponents(1, 2), (2,))] if order == 2 else [])]
    return [(*plane, t) for planes, powers in parts for plane in planes for t in powers]


_FINE, _FOR_MASS = _product(_TRIANGLE, gauss_points(3, 1)), _product(simplex_points(4, 2), gauss_points(3, 1))
_POINTS, _WEIGHTS = _product(_TRIANGLE, gauss_points(2, 1))


class Wedge(AbstractSolid):
    """Triangular prism of six nodes, with an internal mode along its length in each direction.

    Stresses [Pa] at the centre, world axes, tension positive; its forces are the same numbers.
    Nodes 0-2 are one triangle, 3-5 lie over them; seen from 3-5, 0-2 are counter-clockwise.
    Source: Taylor, Beresford and Wilson, Int. J. Numer. Meth. Eng. 10 (1976) 1211-1219.

    Attributes:
        young: modulus [Pa]; poisson; density [kg/m^3].
        moduli: (6, 6) elasticity [Pa] of an anisotropic material in world axes, instead of young and poisson.
    """

    num_nodes = 6
    rule = SolidRule(
        ShapeFunctions(_exponents(1), _CORNERS),
        *(_POINTS, _WEIGHTS, _POINTS, _WEIGHTS, _CENTRE, 6, (), _FACES),
        -2.0 * _POINTS[:, 2, None, None] * np.eye(3)[None, :, 2:],  # slopes of 1 - zeta^2
    )


class QuadraticWedge(AbstractSolid):
    """Triangular prism of fifteen nodes, whose edges and faces may be curved.

    Stresses [Pa] at the centre, world axes, tension positive; its forces are the same numbers.
    Nodes 0-5 as those of `Wedge`; 6-8 are the middles of the edges 01, 12, 20, 9-11 of 03, 14, 25, 12-14 of 34, 45,
    53.
    Source: Zienkiewicz and Taylor, The finite element method (2000), vol. 1, 8.

    Attributes:
        young: modulus [Pa]; poisson; density [kg/m^3].
        moduli: (6, 6) elasticity [Pa] of an anisotropic material in world axes, instead of young and poisson.
    """

    num_nodes = 15
    rule = SolidRule(
        ShapeFunctions(_exponents(2), middles(_CORNERS, _EDGES)),
        *(_FINE[0], _FINE[1], _FOR_MASS[0], _FOR_MASS[1], _CENTRE, 6, _EDGES, _FACES),
    )
