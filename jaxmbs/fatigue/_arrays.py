"""Arrays from users, in a float type."""

import jax.numpy as jnp
from jaxtyping import Array

from ..checks import require_reals
from ..typing import ArrayLike


def float_array(values: ArrayLike) -> Array:
    """An array of reals: single precision remains, whole numbers become the default float type."""
    require_reals(values)
    values = jnp.asarray(values)
    return values if jnp.issubdtype(values.dtype, jnp.floating) else values.astype(float)
