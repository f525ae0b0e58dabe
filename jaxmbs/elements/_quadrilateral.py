"""Four-node shell: MITC4 bending, membrane with incompatible modes and drilling rotations."""

import abc
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..typing import Convertible, Matrix3
from ._base import as_real
from ._residual_bending import residual_bending
from ._shared_matrices import axes_across, condense, gauss_points, inverse_jacobian, linear_shapes
from ._shell import AbstractShell, IsotropicFields, LayeredFields, _plane_rows

_CORNERS = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
_POINTS, _WEIGHTS = gauss_points(2, 2)
_N, _DN = linear_shapes(_CORNERS, _POINTS)  # (4, 4), (4, 2, 4)
_CENTRE = np.zeros((1, 2))
_DN0 = linear_shapes(_CORNERS, _CENTRE)[1]
_DNC = linear_shapes(_CORNERS, _CORNERS)[1]
_BUBBLES = -2.0 * _POINTS[:, :, None] * np.eye(2)  # (q, slope, mode) of 1 - xi^2, 1 - eta^2
_SIDES = np.array([[0.0, 1], [0, -1], [1, 0], [-1, 0]])  # where the transverse shear is tied
_NS, _DNS = linear_shapes(_CORNERS, _SIDES)


class QuadrilateralShell(AbstractShell):
    """Thick or thin shell of four nodes, of any section, free of shear locking.

    Bending: MITC4, Dvorkin and Bathe, Eng. Comput. 1 (1984) 77-88.  Membrane: modes 1 - xi^2, 1 - eta^2 of Taylor,
    Beresford and Wilson, Int. J. Numer. Meth. Eng. 10 (1976) 1211-1219.  Drilling: Hughes and Brezzi, Comput. Meth.
    Appl. Mech. Eng. 72 (1989) 105-121.
    """

    @property
    @abc.abstractmethod
    def drilling_factor(self) -> Array:
        """Modulus of the drilling rotation over the shear modulus."""

    num_nodes = 4
    force_labels = AbstractShell.force_labels + ("Qx", "Qy")

    def axes(self, nodes: Float[Array, "k 3"]) -> Matrix3:
        """Axes (3, 3): x bisects the diagonals, z lies along their vector product."""
        first, second = nodes[2] - nodes[0], nodes[3] - nodes[1]
        return axes_across(first, second, first - second)

    def shapes(self, xy: Float[Array, "k 2"]) -> tuple[Any, Array]:
        """Bilinear shape functions at 2 x 2 points, and their areas."""
        return _N.astype(xy.dtype), inverse_jacobian(_DN, xy)[1] * _WEIGHTS.astype(xy.dtype)

    def slopes(self, xy: Float[Array, "k 2"]) -> tuple[Any, Array]:
        """Slopes of the bilinear shape functions at 2 x 2 points, and their areas."""
        slopes, det = self._slopes(xy, _DN)
        return slopes, det * _WEIGHTS.astype(xy.dtype)

    def _slopes(self, xy, slopes):
        """Slopes (q, 2, 4) in the plane and areas (q,) per unit square."""
        inverse, det = inverse_jacobian(slopes, xy)
        return inverse @ slopes.astype(xy.dtype), det

    def membrane(self, xy: Float[Array, "k 2"]) -> tuple[Any, Array]:
        """Membrane and drilling stiffness with the incompatible modes condensed, and strains at the centre."""
        return condense(self._membrane_parts(xy)[1], 12), _strains(self._slopes(xy, _DN0)[0], 3)[0]

    def _membrane_parts(self, xy):
        """Strain matrices (q, 3, 12 + 4), of the nodes and the incompatible modes, and their stiffness.

        With `corner_drilling`, drilling rotations are tied to those of the bilinear membrane at the corners.
        """
        slopes, det = self._slopes(xy, _DN)
        inverse0, det0 = inverse_jacobian(_DN0, xy)
        bubbles = inverse0 @ _BUBBLES.astype(xy.dtype) * (det0 / det)[:, None, None]
        strain = jnp.concatenate([_strains(slopes, 3), _strains(bubbles, 2)], axis=2)
        weight, A = det * _WEIGHTS.astype(xy.dtype), self.section.membrane
        K = jnp.einsum("q,qai,ab,qbj->ij", weight, strain, A, strain)
        inner = np.r_[np.zeros(12), np.ones(4)].astype(xy.dtype)  # inert where there is no membrane, not 0/0
        K = K + jnp.diag(jnp.where(jnp.all(A == 0), inner, 0.0 * inner))
        if getattr(self, "corner_drilling", False):
            slopes, weight = self._slopes(xy, _DNC)
            turn = jnp.pad(_drilling_rows(slopes, np.eye(4, dtype=xy.dtype)), ((0, 0), (0, 4)))
        else:
            own, inner = _drilling_rows(slopes, _N.astype(xy.dtype)), _drilling_rows(bubbles, None)
            turn = jnp.concatenate([own, inner], axis=1)
        return strain, K + self.drilling_factor * A[2, 2] * jnp.einsum("q,qi,qj->ij", weight, turn, turn)

    def bending(self, xy: Float[Array, "k 2"]) -> tuple[Any, Array]:
        """Bending stiffness with interpolated (MITC4) shear angles, and curvatures at the centre."""
        slopes, det = self._slopes(xy, _DN)
        weight, section = det * _WEIGHTS.astype(xy.dtype), self.section
        curvature, middle = _curvatures(slopes), _curvatures(self._slopes(xy, _DN0)[0])[0]
        shear = self._shear(xy, _POINTS)
        if getattr(self, "residual_bending", False):
            tangents = _DN0[0].astype(xy.dtype) @ xy
            mean = self._shear(xy, _CENTRE)[0]
            return residual_bending(weight, (curvature, middle), (shear, mean), tangents, section), middle
        K = jnp.einsum("q,qai,ab,qbj->ij", weight, curvature, section.bending, curvature)
        return K + jnp.einsum("q,qai,ab,qbj->ij", weight, shear, section.shear, shear), middle

    def corner_strains(self, xy: Float[Array, "k 2"]) -> tuple[Any, Array]:
        """Strain and curvature matrices (4, 3, 12) at the corners, without the incompatible modes."""
        slopes = self._slopes(xy, _DNC)[0]
        return _strains(slopes, 3), _curvatures(slopes)

    def plane_stiffness(self, xy: Float[Array, "k 2"]) -> Float[Array, "n n"]:
        """Stiffness; where membrane and bending are coupled the incompatible modes are condensed behind both."""
        B = self.section.coupling
        if B is None:
            return super().plane_stiffness(xy)
        slopes, det = self._slopes(xy, _DN)
        strain, membrane = self._membrane_parts(xy)
        mixed = jnp.einsum("q,qai,ab,qbj->ij", det * _WEIGHTS.astype(xy.dtype), strain, B, _curvatures(slopes))
        order = np.r_[0:12, 16:28, 12:16]
        whole = jnp.block([[membrane, mixed], [mixed.T, self.bending(xy)[0]]])[np.ix_(order, order)]
        return condense(whole, 24)

    def initial_load(self, nodes: Float[Array, "k 3"], forces: Float[Array, "k f"]) -> Float[Array, " n"]:
        """Consistent load (24,) of forces Nxx ... Mxy (corners, 6) per length that act in it, bilinear between.

        The axes are those of the element; the incompatible modes are condensed, as in the stiffness.
        """
        xy, T = self.plane_coordinates(nodes)
        slopes, det = self._slopes(xy, _DN)
        weight, at = det * _WEIGHTS.astype(xy.dtype), _N.astype(xy.dtype) @ forces
        (strain, membrane), curvature = self._membrane_parts(xy), _curvatures(slopes)
        f = jnp.einsum("q,qai,qa->i", weight, strain, at[:, :3])
        across = jnp.einsum("q,qai,qa->i", weight, curvature, at[:, 3:])
        inner = jnp.linalg.solve(membrane[12:, 12:], f[12:])
        if self.section.coupling is not None:
            mixed = jnp.einsum("q,qai,ab,qbj->ij", weight, strain[:, :, 12:], self.section.coupling, curvature)
            across = across - mixed.T @ inner
        local = jnp.concatenate([f[:12] - membrane[:12, 12:] @ inner, across])
        rows = np.concatenate(_plane_rows(4))
        return T.T @ jnp.zeros(24, local.dtype).at[rows].set(local)

    def _shear(self, xy, points):
        """Transverse shear angles (q, 2, 12) at points of [-1, 1]^2, interpolated from the mid-sides."""
        N, DN = _NS.astype(xy.dtype), _DNS.astype(xy.dtype)
        tangents = DN @ xy  # (4, 2, 2): rows d/dxi, d/deta
        # dw/ds + ry dx/ds - rx dy/ds along both directions s of the square
        parts = [DN, -tangents[:, :, 1, None] * N[:, None, :], tangents[:, :, 0, None] * N[:, None, :]]
        tied = jnp.stack(parts, axis=-1).reshape(4, 2, 12)
        xi, eta = (points[:, d, None].astype(xy.dtype) for d in (0, 1))
        along_xi = ((1 + eta) * tied[0, 0][None] + (1 - eta) * tied[1, 0][None]) / 2
        along_eta = ((1 + xi) * tied[2, 1][None] + (1 - xi) * tied[3, 1][None]) / 2
        inverse = inverse_jacobian(linear_shapes(_CORNERS, points)[1], xy)[0]
        return inverse @ jnp.stack([along_xi, along_eta], axis=1)

    def forces(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, " f"]:
        """Membrane forces, moments and transverse shear forces per length at the centre. Source: S1 (30)."""
        xy, T = self.plane_coordinates(nodes)
        local = (T @ u.reshape(-1)).reshape(4, 6)
        shear = self._shear(xy, _CENTRE)[0] @ local[:, 2:5].reshape(-1)
        return jnp.concatenate([super().forces(nodes, u), self.section.shear @ shear])

    degeneracy = "its corners do not go round a convex outline"

    def is_degenerate(self, nodes: np.ndarray) -> np.ndarray:
        """Flags of elements with a corner of 180 degrees or more."""
        normal = np.cross(nodes[:, 2] - nodes[:, 0], nodes[:, 3] - nodes[:, 1])
        after, before = np.roll(nodes, -1, axis=1) - nodes, np.roll(nodes, 1, axis=1) - nodes
        return np.any(np.sum(np.cross(after, before) * normal[:, None], axis=2) <= 0, axis=1)


class Quadrilateral(IsotropicFields, QuadrilateralShell):
    """Thick or thin shell of four nodes, free of shear locking; a warped one is carried by its mean plane.

    Forces, per length at the centre, in element axes (x bisects the diagonals, z is the normal by the order of the
    nodes): membrane forces Nxx Nyy Nxy [N/m], tension positive, then moments Mxx Myy Mxy [N], positive where the face
    +z is in tension, then transverse shear forces Qx Qy [N/m].
    Stresses [Pa] of the face +z (top), then of -z (bottom).

    Bending: MITC4, Dvorkin and Bathe, Eng. Comput. 1 (1984) 77-88.  Membrane: modes 1 - xi^2, 1 - eta^2 of Taylor,
    Beresford and Wilson, Int. J. Numer. Meth. Eng. 10 (1976) 1211-1219.  Drilling: Hughes and Brezzi, Comput. Meth.
    Appl. Mech. Eng. 72 (1989) 105-121.

    Attributes:
        young: modulus [Pa]; poisson; thickness [m]; density [kg/m^3].
        shear_factor: of the transverse shear.
        drilling: modulus that ties the drilling rotation to the rotation of the membrane, over the shear modulus.
        residual_bending: True for the residual bending flexibility of Nastran's CQUAD4, by which one element bends
            under a force at its end as a beam; under pressure a mesh without it has smaller errors.
        corner_drilling: True if drilling rotations are tied at the corners, to the membrane without its internal
            modes, as those of Nastran's CQUAD4; for a weak `drilling`.
    """

    shear_factor: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real, default=5 / 6)
    drilling: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real, default=0.1)
    residual_bending: bool = eqx.field(static=True, default=False)
    corner_drilling: bool = eqx.field(static=True, default=False)

    @property
    def drilling_factor(self) -> Array:
        """Modulus of the drilling rotation over the shear modulus."""
        return self.drilling


class LayeredQuadrilateral(LayeredFields, QuadrilateralShell):
    """Thick or thin shell of four nodes, of layers or of any other section.

    Forces as of `Quadrilateral`, in the axes of the element, per length at the centre: Nxx Nyy Nxy [N/m], tension
    positive, then moments Mxx Myy Mxy [N], positive where the face +z is in tension, then Qx Qy [N/m].
    Source: Dvorkin and Bathe, Eng. Comput. 1 (1984) 77-88.

    Attributes:
        layup: its section in the axes of the laminate.
        angle: from the x axis of the element, which bisects the diagonals, to that of the laminate, about the normal
            [rad].
        drilling: modulus that ties the drilling rotation to the rotation of the membrane, over the shear modulus.
        residual_bending: True for the residual bending flexibility of Nastran's CQUAD4, by which one element bends
            under a force at its end as a beam; under pressure a mesh without it has smaller errors.
        corner_drilling: True if drilling rotations are tied at the corners, to the membrane without its internal
            modes, as those of Nastran's CQUAD4; for a weak `drilling`.
    """

    drilling: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real, default=0.1)
    residual_bending: bool = eqx.field(static=True, default=False)
    corner_drilling: bool = eqx.field(static=True, default=False)

    @property
    def drilling_factor(self) -> Array:
        """Modulus of the drilling rotation over the shear modulus."""
        return self.drilling


def _strains(slopes, per_node):
    """Strain matrices (q, 3, per_node k) xx, yy, xy of u, v (and the drilling rotation, which strains nothing)."""
    x, y = slopes[:, 0], slopes[:, 1]
    zero = jnp.zeros_like(x)
    rows = [[x, zero, zero], [zero, y, zero], [y, x, zero]]
    return _interleave_nodes(rows, per_node)


def _drilling_rows(slopes, values):
    """Rows (q, 3 k or 2 k) of the drilling rotation minus the rotation `(v,x - u,y) / 2` of the membrane."""
    x, y = slopes[:, 0], slopes[:, 1]
    row = [y / 2, -x / 2] if values is None else [y / 2, -x / 2, values]
    return jnp.stack(row, axis=-1).reshape(len(x), -1)


def _curvatures(slopes):
    """Curvature matrices (q, 3, 12): slopes of the fibre rotations bx = ry, by = -rx over w, rx, ry."""
    x, y = slopes[:, 0], slopes[:, 1]
    zero = jnp.zeros_like(x)
    return _interleave_nodes([[zero, zero, x], [zero, -y, zero], [zero, -x, y]], 3)


def _interleave_nodes(rows, per_node):
    stacked = jnp.stack([jnp.stack(row[:per_node], axis=-1) for row in rows], axis=1)
    return stacked.reshape(*stacked.shape[:2], -1)
