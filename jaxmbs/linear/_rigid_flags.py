"""Rigid modes told from soft ones, and from unstable ones, by the rounding of the stiffness."""

import jax.numpy as jnp
from jax import lax

from ..runtime import jit

#: A mode is rigid where its value is at most so many times the rounding of the stiffness in its shape or, below zero,
#: at least so many: noise must not pass for an instability.
RIGID, NEGATIVE = 8.0, 200.0


@jit
def rigid_flags(K, values, shapes):
    """(m,) which modes strain nothing: values that are rounding of K itself.

    That is of `sum_i K_ii x_i^2`, the energy that the diagonal of K stores in a mode, and what K differs from its
    transpose: products such as those of a reduction show their rounding there.  A soft mount beside a stiff mesh is
    told from a rigid motion by the stiffness where it moves, not by the highest frequency that there is.  A reduced
    matrix made symmetric from outside hides its rounding: give `num_rigid`.
    """
    eps, size = jnp.finfo(values.dtype).eps, jnp.abs(shapes)
    stored = jnp.sum(jnp.abs(jnp.diagonal(K))[:, None] * shapes**2, axis=0)
    uneven = jnp.sum(size * (jnp.abs(K - K.T) @ size), axis=0)
    vectors = eps**1.5 * len(K) * jnp.max(jnp.abs(values))  # the square of their own error
    noise = eps * stored + 10 * (uneven + vectors)
    return lax.stop_gradient((values <= RIGID * noise) & (values >= -NEGATIVE * noise))
