"""Wedges (triangular prisms) of six and of fifteen nodes."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ._residual_bending import side_angles
from ._shape_functions import ShapeFunctions, middles, simplex_exponents, simplex_points
from ._shared_matrices import axes_across, gauss_points
from ._solid import AbstractSolid, SolidRule, natural_strains, strain_components, strain_tensors

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
_SIDES = np.array([[0.5, 0, 0], [0.5, 0.5, 0], [0, 0.5, 0]])
_ALONG = natural_strains(_POINTS, {pair: lambda r: (r[2],) for pair in ((2, 2), (1, 2), (2, 0))})
_SLOPES = [lambda r: r[1] * (1 - 2 * r[0] - r[1]), lambda r: r[0] * (1 - r[0] - 2 * r[1])]  # of L1 L2 L3


def _bubbles():
    """Strains of the displacements `L1 L2 L3` in the plane of the triangle and `1 - zeta^2` across it."""
    first, second = (slope(_POINTS.T) for slope in _SLOPES)
    zero = 0.0 * first
    plane = [[[first, second / 2], [second / 2, zero]], [[zero, first / 2], [first / 2, second]]]
    found = np.zeros((len(_POINTS), 3, 3, 3))
    found[:, :2, :2, :2] = np.moveaxis(np.array(plane), -1, 0)
    found[:, 2, 2, 2] = _POINTS[:, 2]
    return found


class Wedge(AbstractSolid):
    """Triangular prism of six nodes, with internal strains along its length.

    Stresses [Pa] at the centre, world axes, tension positive; its forces are the same numbers.
    Nodes 0-2 are one triangle, 3-5 lie over them; seen from 3-5, 0-2 are counter-clockwise.
    Source: Taylor, Beresford and Wilson, Int. J. Numer. Meth. Eng. 10 (1976) 1211-1219.

    Attributes:
        young: modulus [Pa]; poisson; density [kg/m^3].
        moduli: (6, 6) elasticity [Pa] of an anisotropic material in world axes, instead of young and poisson.
        side_shear: True for the transverse shear of Nastran's CPENTA, from the sides of the triangle half-way along;
            softer in bending, but irregular meshes of it are not exact in uniform transverse shear.
    """

    side_shear: bool = eqx.field(static=True, default=False)

    num_nodes = 6
    rule = SolidRule(
        ShapeFunctions(_exponents(1), _CORNERS),
        *(_POINTS, _WEIGHTS, _POINTS, _WEIGHTS, _CENTRE, 6, (), _FACES, _ALONG),
    )

    def _enhanced_tensors(self) -> np.ndarray:
        """With shear from the sides, those of bubbles: what is along the length is in the shear already."""
        return _bubbles() if self.side_shear else _ALONG

    def _assumed_strains(self, nodes, strains):
        """With `side_shear`, transverse shear angles from those along the three sides of the triangle half-way along.

        They are those of a uniform field and of one that turns about the centre of the circle in the triangle, where
        this circle touches the sides: so are the matrices that NX Nastran 2412 wrote for a deck of pyNastran
        (`static_solid_shell_bar_kelm`), to all digits.
        """
        if not self.side_shear:
            return strains
        middle = (nodes[:3] + nodes[3:]) / 2
        sides = jnp.roll(middle, -1, axis=0) - middle
        axes = axes_across(sides[0], sides[1], sides[0])
        at = strain_tensors(self._strains_at(nodes, _SIDES))
        angles = 2.0 * jnp.einsum("sa,sabn,b->sn", sides, at, axes[2])
        fields = side_angles((sides @ axes.T)[:, :2], angles)
        along = (sides @ axes.T)[:, :2] / jnp.linalg.norm(sides, axis=1)[:, None]
        across = fields[None, :2] + along[:, :, None] * fields[None, None, 2]  # (side, direction, n)
        own = jnp.einsum("ac,qcdn,bd->qabn", axes, strain_tensors(strains), axes)
        halves = jnp.tile(across, (2, 1, 1)) / 2
        own = own.at[:, :2, 2].set(halves).at[:, 2, :2].set(halves)
        return jnp.moveaxis(strain_components(jnp.einsum("ca,qcdn,db->qnab", axes, own, axes)), -1, 1)


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
