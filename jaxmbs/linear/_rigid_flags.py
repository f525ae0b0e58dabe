"""Flags of rigid modes, distinguished from soft and from unstable ones by the rounding of the stiffness."""

import jax.numpy as jnp
from jax import lax
from jaxtyping import Array

from ..blocksparse import BlockMatrix
from ..runtime import jit

#: A mode is rigid where its eigenvalue is at most RIGID times the rounding of the stiffness in its shape and, below
#: zero, at least -NEGATIVE times: wider there, as noise must not pass for an instability.
RIGID, NEGATIVE = 8.0, 200.0


@jit
def rigid_flags(K, values, shapes, diagonal=None):
    """Flags (m,) of modes that strain nothing: their eigenvalue is rounding of K itself.

    The rounding is that of `sum_i K_ii x_i^2`, the energy that the diagonal of K stores in a mode, and the asymmetry
    of K, where products such as those of a reduction show their rounding.  So a soft mount beside a stiff mesh is
    distinguished from a rigid motion by the stiffness where it moves, not by the highest frequency of the system.  A
    reduced matrix that was symmetrised by its user hides its rounding: give `num_rigid`.

    Args: diagonal: (n,) of a stiffness that K was condensed from, in place of K's own.
    """
    size, diagonal = jnp.abs(shapes), jnp.abs(jnp.diagonal(K)) if diagonal is None else diagonal
    stored = jnp.sum(diagonal[:, None] * shapes**2, axis=0)
    uneven = jnp.sum(size * (jnp.abs(K - K.T) @ size), axis=0)
    return _flags(values, stored, uneven, len(K))


def block_rigid_flags(K: BlockMatrix, values: Array, shapes: Array) -> Array:
    """Flags (m,) as `rigid_flags` of a symmetric block matrix and shapes (blocks * size, m)."""
    own = jnp.diagonal(K.diagonal, axis1=1, axis2=2).reshape(-1)
    return _flags(values, jnp.sum(jnp.abs(own)[:, None] * shapes**2, axis=0), 0.0, len(own))


def _flags(values, stored, uneven, rows):
    eps = jnp.finfo(values.dtype).eps
    vectors = eps**1.5 * rows * jnp.max(jnp.abs(values))  # the square of their own error
    noise = eps * stored + 10 * (uneven + vectors)
    return lax.stop_gradient((values <= RIGID * noise) & (values >= -NEGATIVE * noise))
