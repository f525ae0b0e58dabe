"""Bending of a four-node shell with the residual bending flexibility that MacNeal gave it."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from ._shell_section import ShellSection

#: Ratio of the shear stiffness of angles that vary over the element to that of their mean, where bending alone makes
#: it; with 40 displacements of published plates are those that NX Nastran and MSC Nastran printed, to six digits.
_VARYING = 40.0


def residual_bending(
    weight: Float[Array, " q"],
    curvature: tuple[Any, Any],
    shear: tuple[Any, Any],
    tangents: Float[Array, "2 2"],
    section: ShellSection,
) -> Float[Array, "n n"]:
    """Stiffness over w, rx, ry of all nodes.

    Curvatures (q, 3, n) and shear angles (q, 2, n) come with those of the centre; tangents are half the edges of the
    square.  Curvatures of the centre meet the whole bending stiffness; what varies bends along x and along y without
    moments across, and does not twist.  The mean shear angles have the flexibility `h^2 / 12 D` along each direction
    beside that of the section: a force at the end of a strip moves it by what the cubic deflection of a beam has over
    the linear one.

    Source: MacNeal, Comput. Struct. 8 (1978) 175-183, residual bending flexibility.
    """
    (bends, middle), (shears, mean), D = curvature, shear, section.bending
    area, rigid = jnp.sum(weight), D[0, 0] <= 0
    regular = jnp.where(rigid, jnp.eye(3, dtype=D.dtype), D)
    uniaxial = jnp.where(rigid, 0.0, 1.0 / jnp.diag(jnp.linalg.inv(regular))[:2])
    residual = _flexibility(tangents, regular)
    varying, rest = (bends - middle[None])[:, :2], shears - mean[None]
    K = area * (middle.T @ D @ middle + mean.T @ _softened(section.shear, residual) @ mean)
    K = K + jnp.einsum("q,qai,a,qaj->ij", weight, varying, uniaxial, varying)
    return K + jnp.einsum("q,qai,ab,qbj->ij", weight, rest, _softened(section.shear, residual / _VARYING), rest)


def _flexibility(tangents, D):
    """Flexibility (2, 2) [m/N], `h^2 / 12 D` along each of two directions with half the lengths h."""
    x, y = tangents[:, 0], tangents[:, 1]
    along = jnp.stack([x * x, y * y, 2.0 * x * y], axis=1) / jnp.sum(tangents**2, axis=1)[:, None]
    stiffness = jnp.einsum("sa,ab,sb->s", along, D, along)
    return jnp.einsum("s,sa,sb->ab", 1.0 / (3.0 * stiffness), tangents, tangents)


def _softened(S, flexibility):
    """Stiffness of a shear stiffness and a flexibility in series; none where there is none."""
    return jnp.linalg.solve(jnp.eye(2, dtype=S.dtype) + S @ flexibility, S)
