"""Spherical (ball) joint, by a unit quaternion: no gimbal singularity."""

import jax.numpy as jnp
from jaxtyping import Array

from ._base import AbstractJoint, Node


class Spherical(AbstractJoint):
    """Joint that leaves all rotations about a common point free.

    Coordinates: quaternion (w, x, y, z) of the child frame in the parent frame, without unit, (1, 0, 0, 0) where they
    agree, its angle right-handed about (x, y, z).  Velocities: angular velocity [rad/s] of the child in the parent,
    resolved in the child frame.  Efforts: moments about the axes of the child frame [N m].
    """

    nodes = (Node("ball"),)
    labels = ("w", "x", "y", "z")
    row_units = ("m", "m", "m")
    symbol = "ball"

    def closure(self, R: Array, d: Array) -> Array:
        return jnp.asarray(d)
