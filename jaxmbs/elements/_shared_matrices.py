"""Matrices and quadrature shared by several elements."""

import jax
import jax.numpy as jnp
import numpy as np

from ..math._linalg import skew
from ..math._spd import spd_solve


def axes_along(axis, reference=None):
    """Rows x, y, z (3, 3) of axes whose x lies along `axis`; y lies in the plane of `axis` and `reference`."""
    x = axis / jnp.linalg.norm(axis)
    if reference is None:  # any direction across: the coordinate axis that is farthest from x
        reference = jnp.eye(3, dtype=x.dtype)[jnp.argmin(jnp.abs(x))]
    z = jnp.cross(x, reference.astype(x.dtype))
    z = z / jnp.linalg.norm(z)
    return jnp.stack([x, jnp.cross(z, x), z])


def axes_across(first, second, x):
    """Rows x, y, z (3, 3) of axes with z along `first` x `second`; `x` lies across it."""
    z = jnp.cross(first, second)
    z, x = z / jnp.linalg.norm(z), x / jnp.linalg.norm(x)
    return jnp.stack([x, jnp.cross(z, x), z])


def rigid_arm(arm):
    """Matrix (6, 6) of the displacement and rotation of a point rigidly attached to a node at `arm` (3,)."""
    one, zero = jnp.eye(3, dtype=arm.dtype), jnp.zeros((3, 3), arm.dtype)
    return jnp.block([[one, -skew(arm)], [zero, one]])


def axes_transformation(axes):
    """Matrix (6, 6) that resolves displacement and rotation in `axes`, rows x, y, z (3, 3)."""
    return jax.scipy.linalg.block_diag(axes, axes)


def condense(K, keep: int):
    """Condense a stiffness to its first `keep` coordinates, the others being free of load.  Source: S1 (6)."""
    inner = K[keep:, :keep]
    return K[:keep, :keep] - inner.T @ spd_solve(K[keep:, keep:], inner)


def plane_stress(young, poisson):
    """Elasticity (3, 3) in plane stress: stresses xx, yy, xy per strains xx, yy and the shear angle."""
    E, nu = young / (1.0 - poisson**2), poisson
    zero = jnp.zeros_like(E)
    rows = [[E, nu * E, zero], [nu * E, E, zero], [zero, zero, (1.0 - nu) / 2 * E]]
    return jnp.stack([jnp.stack(row) for row in rows])


def inverse_jacobian(slopes, nodes):
    """Inverse (q, d, d) and determinant (q,) of the Jacobian `slopes @ nodes`, d = 2 or 3."""
    J = slopes.astype(nodes.dtype) @ nodes
    if J.shape[1] == 2:
        (a, b), (c, d) = J[:, 0].T, J[:, 1].T
        det = a * d - b * c
        inverse = jnp.stack([jnp.stack([d, -b], axis=1), jnp.stack([-c, a], axis=1)], axis=1)
    else:
        a, b, c = J[:, 0], J[:, 1], J[:, 2]
        bc = jnp.cross(b, c)
        det = jnp.sum(a * bc, axis=1)
        inverse = jnp.stack([bc, jnp.cross(c, a), jnp.cross(a, b)], axis=2)
    return inverse / det[:, None, None], det


def gauss_points(points: int, dimensions: int):
    """Gauss points (q, dimensions) and weights (q,) on [-1, 1]^dimensions."""
    x, w = np.polynomial.legendre.leggauss(points)
    grids = np.meshgrid(*[x] * dimensions, indexing="ij")
    weights = np.meshgrid(*[w] * dimensions, indexing="ij")
    return np.stack([g.ravel() for g in grids], axis=-1), np.prod([g.ravel() for g in weights], axis=0)


def linear_shapes(corners, points):
    """Values (q, k) and slopes (q, dimensions, k) of the shape functions of a square or a cube at `points`."""
    factors = 1.0 + points[:, :, None] * corners.T[None]  # (q, dimensions, k)
    scale = 0.5 ** corners.shape[1]
    values = scale * np.prod(factors, axis=1)
    slopes = [scale * corners.T[d] * np.prod(np.delete(factors, d, axis=1), axis=1) for d in range(corners.shape[1])]
    return values, np.stack(slopes, axis=1)
