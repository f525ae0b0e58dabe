"""Small matrices that several elements share."""

import jax
import jax.numpy as jnp
import numpy as np

from ..math.linalg import skew


def along(axis, reference=None):
    """Rows x, y, z (3, 3) of axes whose x lies along `axis`; y lies in the plane of `axis` and `reference`."""
    x = axis / jnp.linalg.norm(axis)
    if reference is None:  # any direction across: the coordinate axis that is farthest from x
        reference = jnp.eye(3, dtype=x.dtype)[jnp.argmin(jnp.abs(x))]
    z = jnp.cross(x, reference.astype(x.dtype))
    z = z / jnp.linalg.norm(z)
    return jnp.stack([x, jnp.cross(z, x), z])


def carried(arm):
    """(6, 6): displacement and rotation of a point at `arm` (3,) from a node, rigidly carried by it."""
    one, zero = jnp.eye(3, dtype=arm.dtype), jnp.zeros((3, 3), arm.dtype)
    return jnp.block([[one, -skew(arm)], [zero, one]])


def turned(axes):
    """(6, 6): displacement and rotation resolved in `axes`, rows x, y, z (3, 3)."""
    return jax.scipy.linalg.block_diag(axes, axes)


def condensed(K, keep: int):
    """Stiffness of the first `keep` coordinates, the others being free. Source: S1 (6)."""
    inner = K[keep:, :keep]
    return K[:keep, :keep] - inner.T @ jnp.linalg.solve(K[keep:, keep:], inner)


def plane_stress(young, poisson):
    """(3, 3) stress xx, yy, xy by strain xx, yy and the shear angle."""
    E, nu = young / (1.0 - poisson**2), poisson
    zero = jnp.zeros_like(E)
    rows = [[E, nu * E, zero], [nu * E, E, zero], [zero, zero, (1.0 - nu) / 2 * E]]
    return jnp.stack([jnp.stack(row) for row in rows])


def gauss(points: int, dimensions: int):
    """Points (q, dimensions) and weights (q,) on [-1, 1]^dimensions."""
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
