"""Base of solids: strains of shape functions, elasticity, loads on faces."""

from typing import Any, ClassVar, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..math._spd import spd_solve
from ..typing import Convertible, ScalarLike
from ._base import TENSOR, AbstractElement, as_optional_real, as_real
from ._shape_functions import ShapeFunctions, middles, serendipity_exponents, simplex_exponents, simplex_points
from ._shared_matrices import condense, gauss_points, inverse_jacobian

_CORNERS = {3: [(0, 0), (1, 0), (0, 1)], 4: [(-1, -1), (1, -1), (1, 1), (-1, 1)]}
_ORDERS = {3: (3, 1), 4: (4, 1), 6: (3, 2), 8: (4, 2)}


class SolidRule(NamedTuple):
    """Geometry of a kind of solid.

    Attributes:
        shapes: its shape functions.
        points, weights: of quadrature of the stiffness; mass_points, mass_weights: of the mass.
        centre: (1, 3) natural coordinates.
        corners: number of nodes that are corners.
        edges: pairs of corners whose middles are the other nodes, in their order; empty without such nodes.
        sides: corners of each face, counter-clockwise seen from outside.
        enhanced: (q, modes, 3, 3) internal strains at `points`, tensors in natural coordinates whose weighted sum is
            zero, or None.
    """

    shapes: ShapeFunctions
    points: np.ndarray
    weights: np.ndarray
    mass_points: np.ndarray
    mass_weights: np.ndarray
    centre: np.ndarray
    corners: int
    edges: tuple[tuple[int, int], ...]
    sides: tuple[tuple[int, ...], ...]
    enhanced: np.ndarray | None = None

    @property
    def faces(self) -> tuple[tuple[int, ...], ...]:
        """Nodes of each face: its corners, then the middles of its edges in this order."""
        number = {frozenset(edge): self.corners + k for k, edge in enumerate(self.edges)}
        round_about = lambda side: [frozenset(pair) for pair in zip(side, side[1:] + side[:1], strict=True)]
        return tuple((*side, *(number[edge] for edge in round_about(side) if self.edges)) for side in self.sides)


def face_rule(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values (q, k), slopes (q, 2, k) and weights (q,) on a face of 3, 4, 6 or 8 nodes."""
    corners, order = _ORDERS[count]
    edges = [(i, (i + 1) % corners) for i in range(corners)]
    nodes = _CORNERS[corners] if order == 1 else middles(_CORNERS[corners], edges)
    exponents = (simplex_exponents if corners == 3 else serendipity_exponents)(order, 2)
    points, weights = (simplex_points if corners == 3 else gauss_points)(order + 1, 2)
    shapes = ShapeFunctions(exponents, nodes)
    return shapes.values(points), shapes.slopes(points), weights


class AbstractSolid(AbstractElement):
    """Solid with displacements only.  Stresses [Pa] at the centre, world axes, tension positive; its forces are the
    same numbers.

    Attributes:
        young: modulus [Pa]; poisson; density [kg/m^3].
        moduli: (6, 6) elasticity [Pa] of an anisotropic material in world axes, stresses per strains xx yy zz and
            shear angles xy yz zx, which stands for young and poisson; None for an isotropic one.
    """

    young: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real)
    poisson: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real)
    density: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real, default=0.0)
    moduli: Convertible[Float[Array, "..."] | None] = eqx.field(converter=as_optional_real, default=None)

    rule: ClassVar[SolidRule]
    coordinates = 3
    positive_fields = ("young",)
    force_labels = TENSOR
    stress_labels = TENSOR
    degeneracy = "it is inside out or flat somewhere: check the order of its nodes"

    def elasticity(self) -> Array:
        """Elasticity matrix (6, 6): stresses per strains xx, yy, zz and shear angles xy, yz, zx."""
        if self.moduli is not None:
            return self.moduli
        shear = self.young / (2.0 * (1.0 + self.poisson))
        lame = self.young * self.poisson / ((1.0 + self.poisson) * (1.0 - 2.0 * self.poisson))
        normal, twice = np.array([1.0, 1, 1, 0, 0, 0]), np.diag([2.0, 2, 2, 1, 1, 1])
        return shear * jnp.asarray(twice, shear.dtype) + lame * jnp.asarray(np.outer(normal, normal), shear.dtype)

    def stiffness(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Stiffness `int B^T D B dV`, the internal strains condensed.

        Source: Zienkiewicz and Taylor, The finite element method (2000), vol. 1, 6.
        """
        B, volumes = self._all_strains(nodes)
        K = jnp.einsum("qai,ab,qbj->ij", volumes[:, None, None] * B, self.elasticity(), B)
        return K if self.rule.enhanced is None else condense(K, self.size)

    def _all_strains(self, nodes):
        """Strain matrices (q, 6, n + modes) of the nodes and the internal strains, and volumes (q,)."""
        slopes, volumes = self._slopes(nodes, self.rule.points, self.rule.weights)
        B = self._assumed_strains(nodes, _strains(slopes))
        if self.rule.enhanced is not None:
            B = jnp.concatenate([B, self._enhanced_strains(nodes, volumes)], axis=2)
        return B, volumes

    def _enhanced_tensors(self) -> np.ndarray:
        """Internal strains (q, modes, 3, 3) in natural coordinates."""
        return np.asarray(self.rule.enhanced)

    def _strains_at(self, nodes, points):
        """Strain matrices (q, 6, n) of the displacements at natural coordinates (q, 3)."""
        return _strains(self._slopes(nodes, points, np.ones(len(points)))[0])

    def _assumed_strains(self, nodes, strains):
        """Strain matrices (q, 6, n) of the stiffness, from those of the displacements."""
        return strains

    def mass(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Consistent mass."""
        N = self.rule.shapes.values(self.rule.mass_points).astype(nodes.dtype)
        _, volumes = self._slopes(nodes, self.rule.mass_points, self.rule.mass_weights)
        return jnp.kron(self.density * (N.T * volumes[None]) @ N, jnp.eye(3, dtype=nodes.dtype))

    def forces(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, " f"]:
        """The stresses, see `stresses`.  Source: S1 (30)."""
        return self.stresses(nodes, u)

    def stresses(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, " s"]:
        """Stresses (6,) at the centre in world axes, where internal modes strain nothing. Source: S1 (30)."""
        return self.stresses_at(nodes, u, self.rule.centre)[0]

    def corner_stresses(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, "corners 6"]:
        """Stresses at the corners in world axes, of the displacements of the nodes alone."""
        return self.stresses_at(nodes, u, self.rule.shapes.nodes[: self.rule.corners])

    def stresses_at(
        self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"], points: np.ndarray
    ) -> Float[Array, "q 6"]:
        """Stresses at natural coordinates (q, 3), of the displacements of the nodes alone."""
        return self._strains_at(nodes, points) @ u.reshape(-1) @ self.elasticity().T

    def thermal_load(
        self, nodes: Float[Array, "k 3"], expansion: Float[Array, "6"], warming: Float[Array, " k"]
    ) -> Array:
        """Consistent load (3 k,) of warming [K] of the nodes: `int B^T D alpha dT dV`, internal strains condensed.

        Args: expansion: (6,) strains per kelvin in world axes.
        Source: Zienkiewicz and Taylor, The finite element method (2000), vol. 1, 2.
        """
        (B, volumes), D, n = self._all_strains(nodes), self.elasticity(), self.size
        local = self.rule.shapes.values(self.rule.points).astype(nodes.dtype) @ warming
        f = jnp.einsum("q,qai,ab,b->i", volumes * local, B, D, expansion)
        if self.rule.enhanced is None:
            return f
        inner = jnp.einsum("qai,ab,qbj->ij", volumes[:, None, None] * B[:, :, n:], D, B)
        return f[:n] - inner[:, :n].T @ spd_solve(inner[:, n:], f[n:])

    def geometric_stiffness(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, "n n"]:
        """Of the stress at the centre, `int grad N^T sigma grad N dV` in each direction.

        Source: Zienkiewicz and Taylor, The finite element method (2000), vol. 2, 10.3.
        """
        xx, yy, zz, xy, yz, zx = self.stresses(nodes, u)
        sigma = jnp.stack([jnp.stack([xx, xy, zx]), jnp.stack([xy, yy, yz]), jnp.stack([zx, yz, zz])])
        slopes, volumes = self._slopes(nodes, self.rule.points, self.rule.weights)
        return jnp.kron(jnp.einsum("q,qai,ab,qbj->ij", volumes, slopes, sigma, slopes), jnp.eye(3, dtype=nodes.dtype))

    def pressure_load(self, nodes: Float[Array, "k 3"], pressure: ScalarLike, face: int) -> Array:
        """Consistent load (3 k,) of a pressure [Pa] into the element through one of `rule.faces`. Source: S1 (18)."""
        face_nodes = np.array(self.rule.faces[face])
        N, slopes, weights = (a.astype(nodes.dtype) for a in face_rule(len(face_nodes)))
        tangents = slopes @ nodes[face_nodes]
        areas = jnp.cross(tangents[:, 0], tangents[:, 1]) * weights[:, None]
        shares = -pressure * (N.T @ areas)
        return jnp.zeros((self.num_nodes, 3), nodes.dtype).at[face_nodes].set(shares).reshape(-1)

    def is_degenerate(self, nodes: np.ndarray) -> np.ndarray:
        """Flags of elements whose volume is not positive at some quadrature point."""
        J = np.einsum("qdi,mix->mqdx", self.rule.shapes.slopes(self.rule.points), nodes)
        return np.any(np.linalg.det(J) <= 0, axis=1)

    def _slopes(self, nodes, points, weights):
        """Slopes (q, 3, k) of the shape functions in space, and the volumes (q,) that belong to the points."""
        natural = self.rule.shapes.slopes(points).astype(nodes.dtype)
        inverse, det = inverse_jacobian(natural, nodes)
        return inverse @ natural, det * weights.astype(nodes.dtype)

    def _enhanced_strains(self, nodes, volumes):
        """Strain matrices (q, 6, modes) of the internal strains, which the Jacobian at the centre turns, so that
        constant strains need none.

        Source: Simo and Rifai, Int. J. Numer. Meth. Eng. 29 (1990) 1595-1638.
        """
        inverse, det = inverse_jacobian(self.rule.shapes.slopes(self.rule.centre), nodes)
        scale = det * self.rule.weights.astype(nodes.dtype) / volumes
        turned = inverse[0] @ self._enhanced_tensors().astype(nodes.dtype) @ inverse[0].T
        return scale[:, None, None] * jnp.moveaxis(strain_components(turned), -1, 1)


def strain_components(tensors: Array) -> Array:
    """Strains xx yy zz and shear angles xy yz zx (..., 6) of tensors (..., 3, 3)."""
    twice = tensors + jnp.swapaxes(tensors, -1, -2)
    i, j = np.array([(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)]).T
    halved = np.array([0.5, 0.5, 0.5, 1, 1, 1], tensors.dtype)
    return twice[..., i, j] * np.expand_dims(halved, tuple(range(tensors.ndim - 2)))


def strain_tensors(strains: Array) -> Array:
    """Tensors (q, 3, 3, n) of strain matrices (q, 6, n)."""
    xx, yy, zz, xy, yz, zx = jnp.moveaxis(strains, 1, 0)
    rows = [[xx, xy / 2, zx / 2], [xy / 2, yy, yz / 2], [zx / 2, yz / 2, zz]]
    return jnp.stack([jnp.stack(row, axis=1) for row in rows], axis=1)


def natural_strains(points: np.ndarray, patterns: dict[tuple[int, int], Any]) -> np.ndarray:
    """Tensors (q, modes, 3, 3) in natural coordinates, one for each pattern (q,) of each pair of axes."""
    found = []
    for (i, j), values in patterns.items():
        unit = np.zeros((3, 3))
        unit[i, j] = unit[j, i] = 1.0
        found += [value[:, None, None] * unit for value in values(points.T)]
    return np.stack(found, axis=1)


def _strains(slopes):
    """Strain matrices (q, 6, 3 k) from slopes (q, 3, k) of the shape functions."""
    x, y, z = (slopes[:, d] for d in range(3))
    o = jnp.zeros_like(x)
    rows = [[x, o, o], [o, y, o], [o, o, z], [y, x, o], [o, z, y], [z, o, x]]
    return jnp.stack([jnp.stack(row, axis=-1).reshape(len(x), -1) for row in rows], axis=1)
