"""Motions of points as one rigid body."""

import jax.numpy as jnp
from jaxtyping import Array, Float


def rigid_motions(positions, about=None) -> Float[Array, "nodes 6 6"]:
    """Displacements and rotations of points (nodes, 3) in unit translations and rotations about a point (3,)."""
    arms = positions if about is None else positions - jnp.asarray(about, positions.dtype)[None]
    one = jnp.broadcast_to(jnp.eye(3, dtype=arms.dtype), (len(arms), 3, 3))
    turning = jnp.swapaxes(jnp.cross(one, arms[:, None, :]), 1, 2)  # columns e_d x arm
    rows = [jnp.concatenate([one, turning], axis=2), jnp.concatenate([jnp.zeros_like(one), one], axis=2)]
    return jnp.concatenate(rows, axis=1)
