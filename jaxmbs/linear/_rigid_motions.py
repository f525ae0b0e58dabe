"""Motions of points as one rigid body."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..elements import DIRECTIONS
from ..errors import ModelError
from ..runtime import as_dtype, jit
from ..typing import AnyArray, ArrayLike


def rigid_motions(positions: AnyArray, about: ArrayLike | None = None) -> Float[Array, "nodes 6 6"]:
    """Displacements and rotations of points (nodes, 3) in unit translations and rotations about a point (3,)."""
    return _motions(positions if about is None else positions - as_dtype(about, positions.dtype)[None])


@jit
def _motions(arms):
    one = jnp.broadcast_to(jnp.eye(3, dtype=arms.dtype), (len(arms), 3, 3))
    turning = jnp.swapaxes(jnp.cross(one, arms[:, None, :]), 1, 2)  # columns e_d x arm
    rows = [jnp.concatenate([one, turning], axis=2), jnp.concatenate([jnp.zeros_like(one), one], axis=2)]
    return jnp.concatenate(rows, axis=1)


def rigid_rows(system, about=None) -> Float[Array, "n 6"]:
    """`rigid_motions` over the coordinates of a linear system; those without a direction stay at rest.

    Args: about: (3,) [m], default the middle of the nodes.

    Raises: ModelError for a system without the positions of its nodes.
    """
    if system.positions is None:
        raise ModelError(["rigid motions need the positions of the nodes: LinearSystem(..., positions=...)"])
    about = jnp.mean(system.positions, axis=0) if about is None else about
    node = {name: k for k, name in enumerate(system.nodes)}
    at = np.array([node[name] if direction else 0 for name, direction in system.coordinates])
    along = np.array([DIRECTIONS.index(direction) if direction else 0 for _, direction in system.coordinates])
    moving = np.array([bool(direction) for _, direction in system.coordinates])
    return jnp.where(moving[:, None], rigid_motions(system.positions, about)[at, along], 0.0)
