"""Weld: no motion."""

import jax.numpy as jnp

from .base import AbstractJoint, aligned


class Weld(AbstractJoint):
    """The two frames agree; its reaction is the load carried between the two parts."""

    num_rows = 6

    def closure(self, R, d):
        return jnp.concatenate([d, aligned(R)])
