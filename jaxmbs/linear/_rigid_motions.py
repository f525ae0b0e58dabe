"""Rigid-body motions of points and of linear systems."""

import jax.numpy as jnp
import numpy as np
import scipy.sparse
from jaxtyping import Array, Float

from ..blocksparse import BlockMatrix
from ..elements import DIRECTIONS
from ..errors import ModelError
from ..runtime import as_dtype, jit
from ..typing import AnyArray, ArrayLike
from ._block_rows import from_blocks, to_blocks


def rigid_motions(positions: AnyArray, about: ArrayLike | None = None) -> Float[Array, "nodes 6 6"]:
    """Displacements and rotations of points for unit translations and rotations about a reference point.

    Args: positions: (nodes, 3) [m]; about: (3,) [m], default the origin.

    Returns: (nodes, 6, 6); rows are x y z rx ry rz of the node, columns the six rigid motions.
    """
    return _motions(positions if about is None else positions - as_dtype(about, positions.dtype)[None])


@jit
def _motions(arms):
    one = jnp.broadcast_to(jnp.eye(3, dtype=arms.dtype), (len(arms), 3, 3))
    turning = jnp.swapaxes(jnp.cross(one, arms[:, None, :]), 1, 2)  # columns e_d x arm
    rows = [jnp.concatenate([one, turning], axis=2), jnp.concatenate([jnp.zeros_like(one), one], axis=2)]
    return jnp.concatenate(rows, axis=1)


def rigid_rows(system, about=None) -> Float[Array, "n 6"]:
    """Rigid-body motions (n, 6) of the coordinates of a linear system; those without a direction stay at rest.

    Args: about: (3,) [m], default the mean position of the nodes.

    Raises: ModelError for a system without the positions of its nodes.
    """
    if system.positions is None:
        raise ModelError(["rigid motions need the positions of the nodes: LinearSystem(..., positions=...)"])
    about = jnp.mean(system.positions, axis=0) if about is None else about
    node = {name: k for k, name in enumerate(system.nodes)}
    at = np.array([node[name] if direction else 0 for name, direction in system.coordinates])
    along = np.array([DIRECTIONS.index(direction) if direction else 0 for _, direction in system.coordinates])
    moving = np.array([bool(direction) for _, direction in system.coordinates])
    if not moving.any():
        return jnp.zeros((len(moving), 6), system.positions.dtype)
    return jnp.where(moving[:, None], rigid_motions(system.positions, about)[at, along], 0.0)


def rigid_loads(system, about=None) -> Float[Array, "n 6"]:
    """Forces (n, 6) [N, N m] on the coordinates in unit rigid accelerations of a system and the ground that holds it.

    Args: about: as of `rigid_rows`.  Raises: ModelError as `rigid_rows`.
    """
    inertia = _product(system.mass, rigid_rows(system, about), system.block_rows)
    return inertia + ground_loads(system, about)


def ground_loads(system, about=None) -> Float[Array, "n 6"]:
    """Part (n, 6) of `rigid_loads` that is not the mass matrix times the motion of the coordinates."""
    ground = system.coupling_to_ground()
    if ground is None:
        return jnp.zeros((system.num_rows, 6), system.positions.dtype)
    about = jnp.mean(system.positions, axis=0) if about is None else about
    return ground @ rigid_motions(jnp.zeros_like(about)[None], about)[0]


def _product(A, x, rows):
    """Product (n, k) of a matrix of any storage."""
    if isinstance(A, BlockMatrix):
        return from_blocks(A @ to_blocks(x, A.pattern, rows), rows)
    return A @ np.asarray(x) if scipy.sparse.issparse(A) else A @ x
