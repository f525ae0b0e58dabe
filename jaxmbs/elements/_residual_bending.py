"""Bending of shells of three and four nodes with the residual bending flexibility that MacNeal gave them."""

from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ._shell_section import ShellSection

#: Ratio of the shear stiffness of angles that vary over a quadrilateral to that of their mean, where bending alone
#: makes it.  With 40 the matrices of squares of three thicknesses are those that NX Nastran 2412 wrote for a deck of
#: pyNastran (`static_solid_shell_bar_kelm`), to all digits; no paper that we have gives the number.
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


def triangle_bending(
    xy: Float[Array, "3 2"], curvature: Float[Array, "3 n"], section: ShellSection
) -> Float[Array, "n n"]:
    """Stiffness (9, 9) over w, rx, ry of the corners of a triangle of uniform curvature (3, 9).

    The shear angles along its sides are those of a uniform field and of one that turns about the centre of the
    circle in the triangle, the same along all sides.  Both have the residual flexibility of `residual_bending`,
    summed over the sides.  Matrices are those that NX Nastran 2412 wrote of right-angled triangles of three
    thicknesses in a deck of pyNastran (`static_solid_shell_bar_kelm`), to all digits.

    Source: MacNeal, Comput. Struct. 8 (1978) 175-183, residual bending flexibility.
    """
    sides, angles = jnp.roll(xy, -1, axis=0) - xy, side_shears(xy)
    lengths = jnp.linalg.norm(sides, axis=1)
    D, S = section.bending, section.shear
    regular = jnp.where(D[0, 0] <= 0, jnp.eye(3, dtype=D.dtype), D)
    along = sides / lengths[:, None]
    x, y = along.T
    directions = jnp.stack([x * x, y * y, 2.0 * x * y], axis=1)
    bends = jnp.einsum("sa,ab,sb->s", directions, regular, directions)
    residual = jnp.einsum("s,sa,sb->ab", 1.0 / (24.0 * bends), sides, sides)
    turned = jnp.einsum("s,sa,ab,sb->", lengths / jnp.sum(lengths), along, S, along)
    turning = turned / (1.0 + turned * jnp.trace(residual) / 2.0)
    uniform, turn = angles[:2], angles[2]
    area = (sides[0, 0] * sides[1, 1] - sides[0, 1] * sides[1, 0]) / 2.0
    K = curvature.T @ D @ curvature + uniform.T @ _softened(S, residual) @ uniform
    return area * (K + turning * jnp.outer(turn, turn))


def side_shears(xy: Float[Array, "3 2"]) -> Float[Array, "3 n"]:
    """Rows (3, 9) over w, rx, ry of `side_angles`."""
    sides = jnp.roll(xy, -1, axis=0) - xy
    one = np.eye(3, dtype=xy.dtype)
    after = np.roll(one, 1, axis=1)
    ends = (one + after) / 2
    parts = [jnp.asarray(after - one), -sides[:, 1, None] * ends, sides[:, 0, None] * ends]
    return side_angles(sides, jnp.stack(parts, axis=-1).reshape(3, 9))


def side_angles(sides: Float[Array, "3 2"], angles: Float[Array, "3 n"]) -> Float[Array, "3 n"]:
    """Of shear angles along the sides of a triangle, times their lengths: the uniform angles along x and y, and the
    angle along all sides of the field that turns about the centre of the circle in the triangle."""
    lengths = jnp.linalg.norm(sides, axis=1)
    return jnp.linalg.solve(jnp.concatenate([sides, lengths[:, None]], axis=1), angles)
