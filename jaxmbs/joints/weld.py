"""Weld: no motion."""

import jax.numpy as jnp

from .base import AbstractJoint, aligned


class Weld(AbstractJoint):
    """The two frames agree; its reaction is the load carried between the two parts."""

    row_units = ("m", "m", "m", "rad", "rad", "rad")

    def closure(self, R, d):
        return jnp.concatenate([d, aligned(R)])
