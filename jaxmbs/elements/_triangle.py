"""Three-node shell: discrete Kirchhoff-Mindlin bending, optimal membrane with drilling rotations."""

import abc
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..typing import Convertible, Matrix3
from ._base import as_optional_real, as_real
from ._residual_bending import triangle_bending
from ._shared_matrices import axes_across
from ._shell import AbstractShell, IsotropicFields, LayeredFields
from ._shell_section import squared_contraction

# Areas of mid-side quadrature and quadratic shape functions: corners, then mid-sides 12, 23, 31.
_MID_SIDES = np.array([[0.5, 0.5, 0], [0, 0.5, 0.5], [0.5, 0, 0.5]])
_CENTRE = np.full((1, 3), 1 / 3)
# Parameters beta_1 ... beta_9 of the optimal element (Felippa 2003), and their places in the matrices Q_1, Q_2, Q_3
_BETA = np.array([1.0, 2, 1, 0, 1, -1, -1, -1, -2])
_Q = np.array(
    [[[1, 2, 3], [4, 5, 6], [7, 8, 9]], [[9, 7, 8], [3, 1, 2], [6, 4, 5]], [[5, 6, 4], [8, 9, 7], [2, 3, 1]]]
)


class TriangularShell(AbstractShell):
    """Thick or thin shell of three nodes, of any section.

    Bending: DKMT, Katili, Int. J. Numer. Meth. Eng. 36 (1993) 1859-1883, of a thin one DKT.  Membrane: OPT, Felippa,
    Comput. Meth. Appl. Mech. Eng. 192 (2003) 2125-2168; with a `drilling_factor` one of constant strain.
    """

    @property
    @abc.abstractmethod
    def drilling_factor(self) -> Array | None:
        """Modulus of the drilling rotation over the shear modulus, None where it takes part in the membrane."""

    num_nodes = 3
    degeneracy = "its corners lie on a line"

    def axes(self, nodes: Float[Array, "k 3"]) -> Matrix3:
        """Axes (3, 3): x along the first side, z along the normal."""
        first, second = nodes[1] - nodes[0], nodes[2] - nodes[0]
        return axes_across(first, second, first)

    def shapes(self, xy: Float[Array, "k 2"]) -> tuple[Any, Array]:
        """Linear shape functions at the mid-sides, and their areas."""
        return _MID_SIDES.astype(xy.dtype), _area(xy) / 3 * jnp.ones(3, xy.dtype)

    def slopes(self, xy: Float[Array, "k 2"]) -> tuple[Any, Array]:
        """Slopes of the linear shape functions, and the area."""
        return _area_slopes(xy)[None], _area(xy)[None]

    def membrane(self, xy: Float[Array, "k 2"]) -> tuple[Any, Array]:
        """Basic stiffness `L E L^T / (A t)` and the higher-order part of the optimal template, or the drilling."""
        area, A, L, T = _area(xy), self.section.membrane, self._lumping_matrix(xy), _drilling_deviation(xy)
        if self.drilling_factor is not None:
            drilling = self.drilling_factor * A[2, 2] * area / 2 * T.T @ T
            return L @ A @ L.T / area + drilling, L.T / area
        natural = _natural_strain_matrix(xy)
        squares = jnp.sum((jnp.roll(xy, -1, axis=0) - xy) ** 2, axis=1)
        Q = 2.0 * area / 3.0 * jnp.asarray(_BETA[_Q - 1], xy.dtype) / squares[None, :, None]
        means = natural @ ((Q + jnp.roll(Q, -1, axis=0)) / 2)
        turning = area * jnp.einsum("pai,ab,pbj->ij", means, A, means)
        beta = jnp.maximum((1.0 - 4.0 * squared_contraction(A)) / 2, 0.01)  # beta_0; kept positive, Felippa (2003)
        return L @ A @ L.T / area + 0.75 * beta * T.T @ turning @ T, L.T / area

    def _lumping_matrix(self, xy):
        return _lumping_matrix(xy, 1.5 if self.drilling_factor is None else 0.0)

    def bending(self, xy: Float[Array, "k 2"]) -> tuple[Any, Array]:
        """DKMT stiffness, and curvatures at the centre.

        Rotations are quadratic; along each side the transverse shear is uniform and in equilibrium with the bending
        of the side.  With residual bending rotations are linear.
        """
        section, weight = self.section, _area(xy) / 3
        if getattr(self, "residual_bending", False):
            uniform = _uniform_curvature(xy)
            return triangle_bending(xy, uniform, section), uniform
        given = _shear_share(xy, section)
        curvature = _curvatures(xy, _MID_SIDES, given)
        K = weight * jnp.einsum("qai,ab,qbj->ij", curvature, section.bending, curvature)
        shear = _shear(xy, given)
        K = K + weight * jnp.einsum("qai,ab,qbj->ij", shear, section.shear, shear)
        return K, _curvatures(xy, _CENTRE, given)[0]

    def corner_strains(self, xy: Float[Array, "k 2"]) -> tuple[Any, Array]:
        """Strain matrix (1, 3, 9), that of the centre, and curvature matrices (3, 3, 9) at the corners."""
        return self.membrane(xy)[1][None], self._curvatures(xy, np.eye(3))

    def _curvatures(self, xy, points):
        """Curvature matrices (q, 3, 9) over w, rx, ry at points (q, 3) in area coordinates."""
        if getattr(self, "residual_bending", False):
            return jnp.broadcast_to(_uniform_curvature(xy), (len(points), 3, 9))
        return _curvatures(xy, points, _shear_share(xy, self.section))

    def plane_stiffness(self, xy: Float[Array, "k 2"]) -> Float[Array, "n n"]:
        """Stiffness with the work of the coupling on the uniform part of the membrane strains."""
        K, B = super().plane_stiffness(xy), self.section.coupling
        if B is None:
            return K
        mixed = self._lumping_matrix(xy) @ B @ jnp.mean(self._curvatures(xy, _MID_SIDES), axis=0)
        return K.at[:9, 9:].add(mixed).at[9:, :9].add(mixed.T)

    def is_degenerate(self, nodes: np.ndarray) -> np.ndarray:
        """Flags of triangles without area."""
        normal = np.cross(nodes[:, 1] - nodes[:, 0], nodes[:, 2] - nodes[:, 0])
        size = np.ptp(nodes, axis=1).max(axis=1)
        return np.linalg.norm(normal, axis=1) <= 1e-9 * size**2


class Triangle(IsotropicFields, TriangularShell):
    """Thick or thin shell of three nodes.

    Forces, per length at the centre, in element axes (x along the first side, z the normal by the order of the
    nodes): membrane forces Nxx Nyy Nxy [N/m], tension positive, then moments Mxx Myy Mxy [N], positive where the face
    +z is in tension. Stresses [Pa] of the face +z (top), then of -z (bottom).

    Bending: DKMT, Katili, Int. J. Numer. Meth. Eng. 36 (1993) 1859-1883.  Membrane: OPT, Felippa, Comput. Meth. Appl.
    Mech. Eng. 192 (2003) 2125-2168, exact in bending for any shape of rectangle.

    Attributes:
        young: modulus [Pa]; poisson; thickness [m]; density [kg/m^3].
        shear_factor: of the transverse shear.
        drilling: modulus that ties the drilling rotation to the rotation of a membrane of constant strain, over the
            shear modulus; None for the membrane in which drilling rotations take part.
        residual_bending: True for the uniform curvature and the residual bending flexibility of Nastran's CTRIA3;
            under pressure a mesh without it has smaller errors.
    """

    shear_factor: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real, default=5 / 6)
    drilling: Convertible[Float[Array, "..."] | None] = eqx.field(converter=as_optional_real, default=None)
    residual_bending: bool = eqx.field(static=True, default=False)

    @property
    def drilling_factor(self) -> Array | None:
        """Modulus of the drilling rotation over the shear modulus, None where it takes part in the membrane."""
        return self.drilling


class LayeredTriangle(LayeredFields, TriangularShell):
    """Thick or thin shell of three nodes, of layers or of any other section.

    Forces as of `Triangle`, in the axes of the element, per length at the centre: Nxx Nyy Nxy [N/m], tension
    positive, then moments Mxx Myy Mxy [N], positive where the face +z is in tension.
    Source: Felippa, Comput. Meth. Appl. Mech. Eng. 192 (2003) 2125-2168.

    Attributes:
        layup: its section in the axes of the laminate.
        angle: from the x axis of the element, along its first side, to that of the laminate, about the normal [rad].
        drilling, residual_bending: as of `Triangle`.
    """

    drilling: Convertible[Float[Array, "..."] | None] = eqx.field(converter=as_optional_real, default=None)
    residual_bending: bool = eqx.field(static=True, default=False)

    @property
    def drilling_factor(self) -> Array | None:
        """Modulus of the drilling rotation over the shear modulus, None where it takes part in the membrane."""
        return self.drilling


def _area(xy):
    a, b = xy[1] - xy[0], xy[2] - xy[0]
    return (a[0] * b[1] - a[1] * b[0]) / 2


def _area_slopes(xy):
    """Slopes (2, 3) of the area coordinates, which are the linear shape functions."""
    _, _, (x_kj, y_kj) = _side_vectors(xy)
    return jnp.stack([-y_kj, x_kj]) / (2.0 * _area(xy))


def _side_vectors(xy):
    """Components (2, 3) of the vectors i - k, j - i, k - j, where j follows the node i and k follows j."""
    after, before = jnp.roll(xy, -1, axis=0), jnp.roll(xy, 1, axis=0)
    return (xy - before).T, (after - xy).T, (before - after).T


def _lumping_matrix(xy, a):
    """Lumping matrix (9, 3): nodal forces over u, v, drilling of three constant stresses, for unit thickness; moments
    by the factor a."""
    (x_ik, y_ik), (x_ji, y_ji), (x_kj, y_kj) = _side_vectors(xy)
    zero = jnp.zeros_like(x_ik)
    turn = [a / 6 * -y_kj * (y_ik - y_ji), a / 6 * x_kj * (x_ji - x_ik), a / 3 * (x_ji * y_ji - x_ik * y_ik)]
    rows = [[-y_kj, zero, x_kj], [zero, x_kj, -y_kj], turn]
    return jnp.stack([jnp.stack(row, axis=-1) for row in rows], axis=1).reshape(9, 3) / 2


def _natural_strain_matrix(xy):
    """Matrix (3, 3) of the strains xx, yy, xy from the strains along the sides 12, 23, 31."""
    (x_ik, y_ik), (x_ji, y_ji), (x_kj, y_kj) = _side_vectors(xy)
    rows = [-y_kj * y_ik, -x_kj * x_ik, y_kj * x_ik + x_kj * y_ik]
    return jnp.stack(rows) * (x_ji**2 + y_ji**2)[None] / (4.0 * _area(xy) ** 2)


def _drilling_deviation(xy):
    """Matrix (3, 9) of the drilling rotations minus the mean rotation of the displacements."""
    _, _, opposite = _side_vectors(xy)
    mean = jnp.concatenate([opposite.T / (4.0 * _area(xy)), jnp.zeros((3, 1), xy.dtype)], axis=1).reshape(-1)
    return mean[None] + jnp.asarray(np.kron(np.eye(3), [0.0, 0.0, 1.0]), xy.dtype)


def _uniform_curvature(xy):
    """Curvature matrix (3, 9) over w, rx, ry of linear rotations."""
    x, y = _area_slopes(xy)
    zero = jnp.zeros_like(x)
    rows = [[zero, zero, x], [zero, -y, zero], [zero, -x, y]]
    return jnp.stack([jnp.stack(row, axis=-1).reshape(-1) for row in rows])


def _shear_share(xy, section):
    """Share (3,) of the shear in the flexibility of each side, `phi / (1 + phi)` with `phi = 12 D / (S l^2)`."""
    x, y = (jnp.roll(xy, -1, axis=0) - xy).T
    along, sides = jnp.stack([x * x, y * y, 2.0 * x * y], axis=1), jnp.stack([x, y], axis=1)
    bend = 12.0 * jnp.einsum("sa,ab,sb->s", along, section.bending, along)
    shear = (x * x + y * y) ** 2 * jnp.einsum("sa,ab,sb->s", sides, section.shear, sides)
    stiff = bend + shear > 0
    return jnp.where(stiff, bend, 0.0) / jnp.where(stiff, bend + shear, 1.0)


def _shear(xy, given):
    """Transverse shear angles (q, 2, 9) at the mid-sides from those along the sides, which are uniform there."""
    areas, slopes = jnp.asarray(_MID_SIDES, xy.dtype)[:, None, :], _area_slopes(xy)[None]
    after, next_slopes = jnp.roll(areas, -1, axis=2), jnp.roll(slopes, -1, axis=2)
    lag = _deflection_lags(jnp.roll(xy, -1, axis=0) - xy)
    return jnp.einsum("qds,s,sn->qdn", areas * next_slopes - after * slopes, given * 2.0 / 3.0, lag)


def _curvatures(xy, points, given):
    """Curvature matrices (q, 3, 9) over w, rx, ry at points (q, 3) in area coordinates; given: shares of shear."""
    areas = jnp.asarray(points, xy.dtype)[:, None, :]
    slopes = _area_slopes(xy)
    next_slopes, next_areas = jnp.roll(slopes, -1, axis=1), jnp.roll(areas, -1, axis=2)
    quadratic = jnp.concatenate(
        [(4.0 * areas - 1.0) * slopes[None], 4.0 * (areas * next_slopes[None] + next_areas * slopes[None])], axis=2
    )  # (q, 2, 6)
    rotations = _rotations(jnp.roll(xy, -1, axis=0) - xy, given)
    return jnp.einsum("qds,san,cda->qcn", quadratic, rotations, _STRAIN.astype(xy.dtype))


_STRAIN = np.array([[[1.0, 0], [0, 0]], [[0, 0], [0, 1]], [[0, 1], [1, 0]]])  # (component, slope, rotation)


_CORNER, _DIFFERENCE = np.zeros((3, 2, 9)), np.zeros((3, 9))
for _i in range(3):  # fibre rotations bx = ry, by = -rx at the corners; deflections of the ends of each side
    _CORNER[_i, 0, 3 * _i + 2], _CORNER[_i, 1, 3 * _i + 1] = 1.0, -1.0
    _DIFFERENCE[_i, 3 * ((_i + 1) % 3)], _DIFFERENCE[_i, 3 * _i] = 1.0, -1.0
_BOTH = _CORNER + np.roll(_CORNER, -1, axis=0)


def _deflection_lags(sides):
    """Rows (3, 9): 3/2 of what deflections and mean rotations of the ends make of shear along each side, times its
    length."""
    turned = jnp.einsum("sd,sdn->sn", sides, jnp.asarray(_BOTH, sides.dtype))
    return 1.5 * jnp.asarray(_DIFFERENCE, sides.dtype) + 0.75 * turned


def _rotations(sides, given):
    """Matrices (6, 2, 9) of the fibre rotations at corners and mid-sides, from the sides (3, 2)."""
    bent = (1.0 - given) / jnp.sum(sides**2, axis=1)
    middle = (
        jnp.asarray(_BOTH / 2, sides.dtype) - sides[:, :, None] * (bent[:, None] * _deflection_lags(sides))[:, None]
    )
    return jnp.concatenate([jnp.asarray(_CORNER, sides.dtype), middle])
