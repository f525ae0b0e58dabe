"""`Hexahedron`: eight-node solid element with incompatible modes."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..typing import Convertible, ScalarLike
from ._base import AbstractElement, as_real
from ._shared_matrices import condense, gauss_points, inverse_jacobian, linear_shapes

_CORNERS = np.array(
    [[-1.0, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]
)
_POINTS, _WEIGHTS = gauss_points(2, 3)
_N, _DN = linear_shapes(_CORNERS, _POINTS)
_DN0 = linear_shapes(_CORNERS, np.zeros((1, 3)))[1]
_BUBBLES = -2.0 * _POINTS[:, :, None] * np.eye(3)  # (q, slope, mode) of 1 - xi^2, 1 - eta^2, 1 - zeta^2
#: Nodes of the six faces, counter-clockwise seen from outside: -x, +x, -y, +y, -z, +z of the cube.
FACES = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))
_FACE_POINTS, _FACE_WEIGHTS = gauss_points(2, 2)
_FACE_N, _FACE_DN = linear_shapes(np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]]), _FACE_POINTS)


class Hexahedron(AbstractElement):
    """Isotropic brick, displacements only; bends without shear locking and passes the patch test in any shape.

    Stresses [Pa] at the centre, world axes, tension positive; its forces are the same numbers.
    Nodes 0-3 go round one face, 4-7 lie over them; seen from 4-7, 0-3 are counter-clockwise.
    Source: Taylor, Beresford and Wilson, Int. J. Numer. Meth. Eng. 10 (1976) 1211-1219.

    Attributes:
        young: modulus [Pa]; poisson; density [kg/m^3].
    """

    young: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real)
    poisson: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real)
    density: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real, default=0.0)

    num_nodes = 8
    coordinates = 3
    positive_fields = ("young",)
    force_labels = ("xx", "yy", "zz", "xy", "yz", "zx")
    stress_labels = force_labels
    degeneracy = "it is inside out or flat somewhere: check the order of its nodes"

    def elasticity(self) -> Array:
        """Elasticity matrix (6, 6): stresses per strains xx, yy, zz and shear angles xy, yz, zx."""
        shear = self.young / (2.0 * (1.0 + self.poisson))
        lame = self.young * self.poisson / ((1.0 + self.poisson) * (1.0 - 2.0 * self.poisson))
        normal, twice = np.array([1.0, 1, 1, 0, 0, 0]), np.diag([2.0, 2, 2, 1, 1, 1])
        return shear * jnp.asarray(twice, shear.dtype) + lame * jnp.asarray(np.outer(normal, normal), shear.dtype)

    def stiffness(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Stiffness with the nine internal modes condensed."""
        inverse, det = inverse_jacobian(_DN, nodes)
        inverse0, det0 = inverse_jacobian(_DN0, nodes)
        bubbles = inverse0 @ _BUBBLES.astype(nodes.dtype) * (det0 / det)[:, None, None]
        B = _strains(jnp.concatenate([inverse @ _DN.astype(nodes.dtype), bubbles], axis=2))
        weight = det * _WEIGHTS.astype(nodes.dtype)
        return condense(jnp.einsum("qai,ab,qbj->ij", weight[:, None, None] * B, self.elasticity(), B), 24)

    def mass(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Consistent mass."""
        N = _N.astype(nodes.dtype)
        weight = inverse_jacobian(_DN, nodes)[1] * _WEIGHTS.astype(nodes.dtype)
        return jnp.kron(self.density * (N.T * weight[None]) @ N, jnp.eye(3, dtype=nodes.dtype))

    def forces(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, " f"]:
        """The stresses, see `stresses`.  Source: S1 (30)."""
        return self.stresses(nodes, u)

    def stresses(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, " s"]:
        """Stresses (6,) at the centre in world axes, where the internal modes strain nothing. Source: S1 (30)."""
        slopes = inverse_jacobian(_DN0, nodes)[0] @ _DN0.astype(nodes.dtype)
        return self.elasticity() @ _strains(slopes)[0] @ u.reshape(-1)

    def geometric_stiffness(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, "n n"]:
        """Of the stress at the centre, `int grad N^T sigma grad N dV` in each direction.

        Source: Zienkiewicz and Taylor, The finite element method (2000), vol. 2, 10.3.
        """
        xx, yy, zz, xy, yz, zx = self.stresses(nodes, u)
        sigma = jnp.stack([jnp.stack([xx, xy, zx]), jnp.stack([xy, yy, yz]), jnp.stack([zx, yz, zz])])
        inverse, det = inverse_jacobian(_DN, nodes)
        slopes = inverse @ _DN.astype(nodes.dtype)
        scalar = jnp.einsum("q,qai,ab,qbj->ij", det * _WEIGHTS.astype(nodes.dtype), slopes, sigma, slopes)
        return jnp.kron(scalar, jnp.eye(3, dtype=nodes.dtype))

    def pressure_load(self, nodes: Float[Array, "k 3"], pressure: ScalarLike, face: int) -> Array:
        """Consistent load (24,) of a pressure [Pa] into the element through one of `FACES`. Source: S1 (18)."""
        corners = np.array(FACES[face])
        tangents = _FACE_DN.astype(nodes.dtype) @ nodes[corners]
        areas = jnp.cross(tangents[:, 0], tangents[:, 1]) * _FACE_WEIGHTS.astype(nodes.dtype)[:, None]
        share = -pressure * (_FACE_N.T.astype(nodes.dtype) @ areas)
        return jnp.zeros((8, 3), nodes.dtype).at[corners].set(share).reshape(-1)

    def is_degenerate(self, nodes: np.ndarray) -> np.ndarray:
        """Flags of elements whose volume is not positive at some quadrature point."""
        return np.any(np.linalg.det(np.einsum("qdi,mix->mqdx", _DN, nodes)) <= 0, axis=1)


def _strains(slopes):
    """Strain matrices (q, 6, 3 k) from slopes (q, 3, k) of the shape functions."""
    x, y, z = (slopes[:, d] for d in range(3))
    o = jnp.zeros_like(x)
    rows = [[x, o, o], [o, y, o], [o, o, z], [y, x, o], [o, z, y], [z, o, x]]
    return jnp.stack([jnp.stack(row, axis=-1).reshape(len(x), -1) for row in rows], axis=1)
