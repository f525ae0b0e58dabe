"""Eight-node solid with incompatible modes."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ._parts import condensed, gauss, linear_shapes
from .base import AbstractElement, number

_CORNERS = np.array(
    [[-1.0, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]
)
_POINTS, _WEIGHTS = gauss(2, 3)
_N, _DN = linear_shapes(_CORNERS, _POINTS)
_DN0 = linear_shapes(_CORNERS, np.zeros((1, 3)))[1]
_BUBBLES = -2.0 * _POINTS[:, :, None] * np.eye(3)  # (q, slope, mode) of 1 - xi^2, 1 - eta^2, 1 - zeta^2
#: Nodes of the six faces, seen from outside counter-clockwise: -x, +x, -y, +y, -z, +z of the cube.
FACES = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))
_SQUARE = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
_FACE_POINTS, _FACE_WEIGHTS = gauss(2, 2)
_FACE_N, _FACE_DN = linear_shapes(_SQUARE, _FACE_POINTS)


class Hexahedron(AbstractElement):
    """Isotropic brick, displacements only; bends without shear locking and passes the patch test in any shape.

    Nodes 0-3 counter-clockwise seen from the side of 4-7, which lie over them.
    Source: Taylor, Beresford and Wilson, Int. J. Numer. Meth. Eng. 10 (1976) 1211-1219.

    Attributes:
        young: modulus [Pa]; poisson; density [kg/m^3].
    """

    young: Float[Array, "..."] = eqx.field(converter=number)
    poisson: Float[Array, "..."] = eqx.field(converter=number)
    density: Float[Array, "..."] = eqx.field(converter=number, default=0.0)

    num_nodes = 8
    coordinates = 3
    force_labels = ("xx", "yy", "zz", "xy", "yz", "zx")
    stress_labels = force_labels

    def elasticity(self):
        """(6, 6) stresses by strains xx, yy, zz and shear angles xy, yz, zx."""
        shear = self.young / (2.0 * (1.0 + self.poisson))
        lame = self.young * self.poisson / ((1.0 + self.poisson) * (1.0 - 2.0 * self.poisson))
        normal = np.diag([1.0, 1, 1, 0, 0, 0])
        twice = np.diag([2.0, 2, 2, 1, 1, 1])
        block = np.outer(np.diag(normal), np.diag(normal))
        return shear * jnp.asarray(twice, shear.dtype) + lame * jnp.asarray(block, shear.dtype)

    def stiffness(self, nodes):
        """Strain energy with the nine internal modes condensed."""
        J, J0 = (slopes.astype(nodes.dtype) @ nodes for slopes in (_DN, _DN0))
        det, det0 = jnp.linalg.det(J), jnp.linalg.det(J0)
        bubbles = jnp.linalg.inv(J0) @ _BUBBLES.astype(nodes.dtype) * (det0 / det)[:, None, None]
        slopes = jnp.concatenate([jnp.linalg.inv(J) @ _DN.astype(nodes.dtype), bubbles], axis=2)
        B = _strains(slopes)
        weight = det * _WEIGHTS.astype(nodes.dtype)
        return condensed(jnp.einsum("qai,ab,qbj->ij", weight[:, None, None] * B, self.elasticity(), B), 24)

    def mass(self, nodes):
        """Consistent mass."""
        N = _N.astype(nodes.dtype)
        weight = jnp.linalg.det(_DN.astype(nodes.dtype) @ nodes) * _WEIGHTS.astype(nodes.dtype)
        share = self.density * jnp.einsum("q,qi,qj->ij", weight, N, N)
        return jnp.kron(share, jnp.eye(3, dtype=nodes.dtype))

    def forces(self, nodes, u):
        """As `stresses`. Source: S1 (30)."""
        return self.stresses(nodes, u)

    def stresses(self, nodes, u):
        """Stresses (6,) at the centre in world axes, where the internal modes strain nothing. Source: S1 (30)."""
        slopes = _DN0.astype(nodes.dtype)
        return self.elasticity() @ _strains(jnp.linalg.inv(slopes @ nodes) @ slopes)[0] @ u.reshape(-1)

    def pressure_load(self, nodes, pressure, face: int):
        """Consistent load (24,) of a pressure [Pa] into the element through one of `FACES`. Source: S1 (18)."""
        corners = np.array(FACES[face])
        tangents = _FACE_DN.astype(nodes.dtype) @ nodes[corners]
        areas = jnp.cross(tangents[:, 0], tangents[:, 1]) * _FACE_WEIGHTS.astype(nodes.dtype)[:, None]
        share = -pressure * jnp.einsum("qi,qd->id", _FACE_N.astype(nodes.dtype), areas)
        return jnp.zeros((8, 3), nodes.dtype).at[corners].set(share).reshape(-1)


def _strains(slopes):
    """(q, 6, 3 k) from slopes (q, 3, k) of the shape functions."""
    x, y, z = (slopes[:, d] for d in range(3))
    o = jnp.zeros_like(x)
    rows = [[x, o, o], [o, y, o], [o, o, z], [y, x, o], [o, z, y], [z, o, x]]
    return jnp.stack([jnp.stack(row, axis=-1).reshape(len(x), -1) for row in rows], axis=1)
