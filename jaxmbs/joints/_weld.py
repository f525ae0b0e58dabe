"""Weld: no motion."""

import jax.numpy as jnp
from jaxtyping import Array

from ._base import AbstractJoint, alignment_rows


class Weld(AbstractJoint):
    """Rigid connection: the two frames coincide; its reaction is the load transmitted between the two parts.

    Coordinates: none, and no velocity.
    """

    row_units = ("m", "m", "m", "rad", "rad", "rad")
    is_reversible = True
    symbol = "weld"

    def closure(self, R: Array, d: Array) -> Array:
        return jnp.concatenate([d, alignment_rows(R)])
