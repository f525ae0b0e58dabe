"""Curved shells of six and of eight nodes, with nodes at the middles of their sides."""

from typing import ClassVar, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..typing import Convertible, Matrix3, ScalarLike
from ._base import AbstractElement, as_real
from ._shape_functions import ShapeFunctions, middles, serendipity_exponents, simplex_exponents, simplex_points
from ._shared_matrices import gauss_points
from ._shell_section import ShellSection, require_section, strain_rotation

_TRIANGLE = ShapeFunctions(simplex_exponents(2, 2), middles([(0, 0), (1, 0), (0, 1)], [(0, 1), (1, 2), (2, 0)]))
_SQUARE = ShapeFunctions(
    serendipity_exponents(2, 2), middles([(-1, -1), (1, -1), (1, 1), (-1, 1)], [(0, 1), (1, 2), (2, 3), (3, 0)])
)
_FINE, _NINE, _FOUR = simplex_points(3, 2), gauss_points(3, 2), gauss_points(2, 2)
_INNER = np.array([[1 / 6, 1 / 6], [2 / 3, 1 / 6], [1 / 6, 2 / 3]]), np.full(3, 1 / 6)


class ShellRule(NamedTuple):
    """Shape functions; points and weights of quadrature; fewer ones of membrane and shear; the centre (1, 2)."""

    shapes: ShapeFunctions
    points: np.ndarray
    weights: np.ndarray
    few_points: np.ndarray
    few_weights: np.ndarray
    centre: np.ndarray


class QuadraticShell(AbstractElement):
    """Thick or thin shell with six coordinates per node, of any section, whose sides and surface may be curved.

    The fibre at each point of quadrature turns with the rotations interpolated there; membrane and transverse shear
    are taken at fewer points, so that thin ones do not lock.  Forces per length at the centre, in element axes (x
    along the first natural coordinate, z the normal by the order of the nodes): membrane forces Nxx Nyy Nxy [N/m],
    tension positive, then moments Mxx Myy Mxy [N], positive where the face +z is in tension, then transverse
    shear forces Qx Qy [N/m].

    Source: Zienkiewicz, Taylor and Too, Int. J. Numer. Meth. Eng. 3 (1971) 275-290.

    Attributes:
        layup: its section, in the axes of the laminate.
        angle: from the x axis of the element to that of the laminate, about the normal [rad].
        drilling: modulus that ties the rotation about the normal to the rotation of the membrane, over the shear
            modulus.
    """

    layup: ShellSection
    angle: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real, default=0.0)
    drilling: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real, default=0.1)

    def __check_init__(self):
        require_section(self.layup)

    rule: ClassVar[ShellRule]
    force_labels = ("Nxx", "Nyy", "Nxy", "Mxx", "Myy", "Mxy", "Qx", "Qy")
    degeneracy = "it is folded or flat somewhere: check the order of its nodes"

    def axes(self, nodes: Float[Array, "k 3"]) -> Matrix3:
        """Axes (3, 3) at the centre."""
        return self._surface(nodes, self.rule.centre)[2][0]

    def stiffness(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Stiffness of bending and drilling, and of membrane and transverse shear at fewer points."""
        section = self.layup.rotate(self.angle)
        A, D, B = section.membrane, section.bending, section.coupling
        _, k, _, turn, areas = self._strains(nodes, self.rule.points, self.rule.weights)
        K = jnp.einsum("q,qai,ab,qbj->ij", areas, k, D - _bending_of(A, B), k)
        K = K + self.drilling * A[2, 2] * jnp.einsum("q,qi,qj->ij", areas, turn, turn)
        e, k, g, _, areas = self._strains(nodes, self.rule.few_points, self.rule.few_weights)
        K = K + jnp.einsum("q,qai,ab,qbj->ij", areas, e, A, e)
        if B is not None:
            mixed = jnp.einsum("q,qai,ab,qbj->ij", areas, e, B, k)
            K = K + mixed + mixed.T + jnp.einsum("q,qai,ab,qbj->ij", areas, k, _bending_of(A, B), k)
        g = self._shear_angles(nodes, self.rule.few_points, g)
        return K + jnp.einsum("q,qai,ab,qbj->ij", areas, g, section.shear, g)

    def mass(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Consistent mass per area of displacements and turning mass of rotations, about the normal included."""
        N, _, _, areas = self._surface(nodes, self.rule.points, self.rule.weights)
        per_node = jnp.diag(jnp.stack([self.layup.area_mass] * 3 + [self.layup.turning_mass] * 3))
        return jnp.kron(jnp.einsum("q,qi,qj->ij", areas, N, N), per_node)

    def forces(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, " f"]:
        """Membrane forces, moments and transverse shear forces per length at the centre. Source: S1 (30)."""
        section = self.layup.rotate(self.angle)
        e, k, g, _, _ = self._strains(nodes, self.rule.centre, np.ones(1))
        g = self._shear_angles(nodes, self.rule.centre, g)
        e, k, g = (part[0] @ u.reshape(-1) for part in (e, k, g))
        N, M = section.membrane @ e, section.bending @ k
        if section.coupling is not None:
            N, M = N + section.coupling @ k, M + section.coupling.T @ e
        return jnp.concatenate([N, M, section.shear @ g])

    def pressure_load(self, nodes: Float[Array, "k 3"], pressure: ScalarLike) -> Array:
        """Consistent load (6 k,) of a pressure [Pa] along the normal z. Source: S1 (18)."""
        N, _, axes, areas = self._surface(nodes, self.rule.points, self.rule.weights)
        f = pressure * jnp.einsum("q,qk,qx->kx", areas, N, axes[:, 2])
        return jnp.concatenate([f, jnp.zeros_like(f)], axis=1).reshape(-1)

    def thermal_load(self, nodes: Float[Array, "k 3"], expansion: Float[Array, "3"], warming: Array) -> Array:
        """Consistent load (6 k,) of warming (k,) [K], which makes membrane forces `expansion` (3,) per kelvin where
        nothing moves, in the axes of the laminate."""
        e, _, _, _, areas = self._strains(nodes, self.rule.points, self.rule.weights)
        local = self.rule.shapes.values(self.rule.points).astype(nodes.dtype) @ warming
        return jnp.einsum("q,qai,a->i", areas * local, e, turned_forces(expansion, self.angle))

    def _shear_angles(self, nodes, points, of_displacements):
        """Transverse shear angles (q, 2, n) at points, from those of the displacements there."""
        return of_displacements

    def is_degenerate(self, nodes: np.ndarray) -> np.ndarray:
        """Flags of elements whose normals turn by a right angle or more, or that have no area."""
        tangents = np.einsum("qdi,mix->mqdx", self.rule.shapes.slopes(self.rule.points), nodes)
        normals = np.cross(tangents[:, :, 0], tangents[:, :, 1])
        return np.any(np.einsum("mqx,mx->mq", normals, normals.mean(axis=1)) <= 0, axis=1)

    def _surface(self, nodes, points, weights=None):
        """Values (q, k) and slopes (q, 2, k) in the local axes, which are rows (q, 3, 3), and areas (q,)."""
        inverse, det, axes = self._jacobian(nodes, points)
        values, slopes = self.rule.shapes.values(points), self.rule.shapes.slopes(points)
        weights = np.ones(len(points)) if weights is None else weights
        slopes = inverse @ slopes.astype(nodes.dtype)
        return values.astype(nodes.dtype), slopes, axes, det * weights.astype(nodes.dtype)

    def _jacobian(self, nodes, points):
        """Inverse (q, 2, 2) and determinant (q,) of the Jacobian to the local axes, which are rows (q, 3, 3)."""
        tangents = self.rule.shapes.slopes(points).astype(nodes.dtype) @ nodes
        normal = jnp.cross(tangents[:, 0], tangents[:, 1])
        z = normal / jnp.linalg.norm(normal, axis=1, keepdims=True)
        x = tangents[:, 0] / jnp.linalg.norm(tangents[:, 0], axis=1, keepdims=True)
        axes = jnp.stack([x, jnp.cross(z, x), z], axis=1)
        J = jnp.einsum("qdx,qax->qda", tangents, axes[:, :2])
        (a, b), (c, d) = J[:, 0].T, J[:, 1].T
        det = a * d - b * c
        inverse = jnp.stack([jnp.stack([d, -b], axis=1), jnp.stack([-c, a], axis=1)], axis=1) / det[:, None, None]
        return inverse, det, axes

    def _strains(self, nodes, points, weights):
        """Matrices over all coordinates: membrane strains (q, 3, n), curvatures (q, 3, n), shear angles (q, 2, n),
        the drilling rotation less that of the membrane (q, n); areas (q,)."""
        N, slopes, axes, areas = self._surface(nodes, points, weights)
        x, y, z = axes[:, 0], axes[:, 1], axes[:, 2]
        # The fibre z moves by theta x z: along x by theta . y, along y by -theta . x.
        along = lambda s, axis: jnp.einsum("qk,qx->qkx", s, axis)
        sx, sy = slopes[:, 0], slopes[:, 1]
        membrane = [along(sx, x), along(sy, y), along(sy, x) + along(sx, y)]
        bending = [along(sx, y), along(sy, -x), along(sy, y) - along(sx, x)]
        shear = [(along(sx, z), along(N, y)), (along(sy, z), along(N, -x))]
        turn = (along(sy, x) - along(sx, y)) / 2, along(N, z)
        zero = jnp.zeros_like(membrane[0])
        join = lambda u, theta: jnp.concatenate([u, theta], axis=2).reshape(len(areas), -1)
        e = jnp.stack([join(u, zero) for u in membrane], axis=1)
        k = jnp.stack([join(zero, theta) for theta in bending], axis=1)
        g = jnp.stack([join(*pair) for pair in shear], axis=1)
        return e, k, g, join(*turn), areas


def _bending_of(A, B):
    """Bending stiffness `B^T A^-1 B` that the coupling implies, taken where the membrane is: the rest is positive."""
    return 0.0 * A if B is None else B.T @ jnp.linalg.solve(A, B)


def _linear_fields(points):
    """Matrix (q, 2, 6) of the two components of linear vector fields at points, by their six coefficients."""
    one = np.column_stack([np.ones(len(points)), points])
    zero = np.zeros_like(one)
    return np.stack([np.hstack([one, zero]), np.hstack([zero, one])], axis=1)


#: Two points on each side of the triangle, directions of the sides, and the coefficients of linear fields from the
#: components along the sides there.
_AT = 0.5 - 0.5 / 3.0**0.5, 0.5 + 0.5 / 3.0**0.5
_TIES = np.array([p for t in _AT for p in ((t, 0.0), (0.0, t), (t, 1.0 - t))])
_TANGENTS = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 1.0]] * 2)
_FIELDS = np.linalg.inv(np.einsum("qd,qdc->qc", _TANGENTS, _linear_fields(_TIES)))


def turned_forces(forces, angle):
    """Membrane forces (3,) of a laminate in axes from which its own are turned by `angle` [rad]."""
    return strain_rotation(angle).T @ forces


class QuadraticTriangle(QuadraticShell):
    """Curved shell of six nodes: corners 0-2, then the middles of the sides 01, 12, 20.

    Forces per length at the centre as of `QuadraticShell` [N/m, N], tension positive.  Its transverse shear is
    linear, from the angles along its sides at two points of each.
    Source: Lee and Bathe, Comput. Struct. 82 (2004) 945-962 (MITC6a).

    Attributes:
        layup: its section, in the axes of the laminate.
        angle: from the x axis of the element, along its first side, to that of the laminate, about the normal [rad].
        drilling: modulus that ties the rotation about the normal to that of the membrane, over the shear modulus.
    """

    num_nodes = 6
    rule = ShellRule(_TRIANGLE, _FINE[0], _FINE[1], _INNER[0], _INNER[1], np.full((1, 2), 1 / 3))

    def _shear_angles(self, nodes, points, of_displacements):
        """Linear fields through the angles along the sides at their two Gauss points."""
        _, _, axes, _ = self._surface(nodes, _TIES)
        values = _TRIANGLE.values(_TIES).astype(nodes.dtype)
        along = np.einsum("qd,qdk->qk", _TANGENTS, _TRIANGLE.slopes(_TIES)).astype(nodes.dtype)
        z, tangents = axes[:, 2], along @ nodes  # z . du/ds + tangent . (theta x z)
        rows = [along[:, :, None] * z[:, None], values[:, :, None] * jnp.cross(z, tangents)[:, None]]
        tied = jnp.concatenate(rows, axis=2).reshape(len(_TIES), -1)
        natural = jnp.einsum("qdt,tn->qdn", jnp.asarray(_linear_fields(points) @ _FIELDS, nodes.dtype), tied)
        return self._jacobian(nodes, points)[0] @ natural


class QuadraticQuadrilateral(QuadraticShell):
    """Curved shell of eight nodes: corners 0-3, then the middles of the sides 01, 12, 23, 30.

    Forces per length at the centre as of `QuadraticShell` [N/m, N], tension positive.
    Source: Zienkiewicz, Taylor and Too, Int. J. Numer. Meth. Eng. 3 (1971) 275-290.

    Attributes:
        layup: its section, in the axes of the laminate.
        angle: from the x axis of the element, along its first natural coordinate, to that of the laminate, about the
            normal [rad].
        drilling: modulus that ties the rotation about the normal to that of the membrane, over the shear modulus.
    """

    num_nodes = 8
    rule = ShellRule(_SQUARE, _NINE[0], _NINE[1], _FOUR[0], _FOUR[1], np.zeros((1, 2)))
