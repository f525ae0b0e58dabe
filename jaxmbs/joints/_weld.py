"""Weld: no motion."""

import jax.numpy as jnp
from jaxtyping import Array

from ._base import AbstractJoint, aligned


class Weld(AbstractJoint):
    """The two frames agree; its reaction is the load carried between the two parts.

    Coordinates: none, and no velocity.
    """

    row_units = ("m", "m", "m", "rad", "rad", "rad")
    is_reversible = True

    def closure(self, R: Array, d: Array) -> Array:
        return jnp.concatenate([d, aligned(R)])
