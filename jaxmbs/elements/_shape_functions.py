"""Shape functions of nodes from their monomials, and points of quadrature on triangles and tetrahedra."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ._shared_matrices import gauss_points


class ShapeFunctions:
    """Polynomials that are one at one node and zero at the others.

    Args:
        exponents: (k, d) of the k monomials that span them.
        nodes: (k, d) natural coordinates of the nodes.

    Source: Zienkiewicz and Taylor, The finite element method (2000), vol. 1, 8.
    """

    def __init__(self, exponents: Any, nodes: Any) -> None:
        self.exponents, self.nodes = np.array(exponents, int), np.array(nodes, float)
        self._factors = np.linalg.inv(self._monomials(self.nodes))

    def values(self, points: np.ndarray) -> np.ndarray:
        """Values (q, k) at points (q, d)."""
        return self._monomials(points) @ self._factors

    def slopes(self, points: np.ndarray) -> np.ndarray:
        """Slopes (q, d, k) at points (q, d)."""
        parts = [self._monomials(points, by) @ self._factors for by in range(self.nodes.shape[1])]
        return np.stack(parts, axis=1)

    def _monomials(self, points, by=None):
        """Monomials (q, k) at points, or their derivatives by one coordinate."""
        powers, factor = self.exponents.copy(), 1.0
        if by is not None:
            factor = self.exponents[:, by]
            powers[:, by] = np.maximum(powers[:, by] - 1, 0)
        return factor * np.prod(points[:, None, :] ** powers, axis=2)


def _powers(highest: int, dimensions: int) -> np.ndarray:
    return np.stack([g.ravel() for g in np.meshgrid(*[range(highest + 1)] * dimensions, indexing="ij")], axis=1)


def simplex_exponents(order: int, dimensions: int) -> np.ndarray:
    """Monomials of total degree up to `order`, those of triangles and tetrahedra."""
    powers = _powers(order, dimensions)
    return powers[powers.sum(axis=1) <= order]


def serendipity_exponents(order: int, dimensions: int) -> np.ndarray:
    """Monomials of squares and cubes with nodes at corners and, for order 2, at the middles of edges.

    Their degree is at most `order` where what enters linearly does not count.
    Source: Arnold and Awanou, Found. Comput. Math. 11 (2011) 337-344.
    """
    powers = _powers(order, dimensions)
    return powers[np.where(powers > 1, powers, 0).sum(axis=1) <= order]


def middles(corners: Sequence, edges: Sequence) -> np.ndarray:
    """Corners (c, d) and the middles of edges, pairs of corners, behind them."""
    corners = np.array(corners, float)
    return np.concatenate([corners, corners[np.array(edges)].mean(axis=1)])


def simplex_points(points: int, dimensions: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (q, d) and weights (q,) on the unit triangle or tetrahedron, exact to degree `2 points - d`.

    A square or cube of Gauss points is collapsed to it.
    Source: Stroud, Approximate calculation of multiple integrals (1971), 2.4.
    """
    x, weights = gauss_points(points, dimensions)
    x, weights = (1.0 + x) / 2.0, weights / 2.0**dimensions
    found, left = np.zeros_like(x), np.ones(len(x))
    for d in range(dimensions):
        found[:, d], weights = left * x[:, d], weights * left
        left = left * (1.0 - x[:, d])
    return found, weights
