"""Screws of poses: the motion along a helix that takes one frame to another, by logarithm and exponential of SE(3).

A screw is (translation, rotation vector) (6,) in the axes of the first frame; followed for a part of its length it
gives the poses between the two frames.  Values and derivatives are finite from no rotation up to half a turn.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..typing import Matrix3, Vector3
from ._rotation import rotation_matrix, rotation_vector, rotation_vector_coefficient, rotation_vector_rate

Screw = Float[Array, "6"]


def screw_of_pose(rotation: Matrix3, displacement: Vector3) -> Screw:
    """Screw of a pose: rotation (3, 3) and displacement (3,) of the second frame in the axes of the first."""
    vector = rotation_vector(rotation)
    return jnp.concatenate([_translation(vector, displacement), vector])


def pose_of_screw(screw: Screw) -> tuple[Matrix3, Vector3]:
    """Rotation (3, 3) and displacement (3,) that a screw makes.

    The translation is solved from the logarithm's, whose matrix is regular up to a full turn.
    """
    slide, vector = screw[:3], screw[3:]
    columns = jax.vmap(_translation, (None, 0), 1)(vector, jnp.eye(3, dtype=screw.dtype))
    return rotation_matrix(vector), _solve3(columns, slide)


def screw_rate(screw: Screw, displacement: Vector3, velocity: Vector3, angular_velocity: Vector3) -> Screw:
    """Rate of a screw from the velocity of the second frame's origin and its angular velocity, in first axes."""
    vector_rate = rotation_vector_rate(screw[3:], angular_velocity)
    slide_rate = jax.jvp(_translation, (screw[3:], displacement), (vector_rate, velocity))[1]
    return jnp.concatenate([slide_rate, vector_rate])


def wrench_of_screw_gradient(screw: Screw, displacement: Vector3, gradient: Screw) -> tuple[Vector3, Vector3]:
    """Force and moment (3,) at the second frame, in first axes, that make the power `gradient . screw_rate`."""
    vector, covector = screw[3:], gradient[3:]
    of_vector, force = jax.vjp(_translation, vector, displacement)[1](gradient[:3])
    covector = covector + of_vector
    turn = jnp.cross(vector, covector)
    moment = covector + turn / 2 + rotation_vector_coefficient(vector @ vector) * jnp.cross(vector, turn)
    return force, moment


def _translation(vector, displacement):
    """Translation of the screw: `d - w x d / 2 + c w x (w x d)`, linear in the displacement."""
    turn = jnp.cross(vector, displacement)
    return displacement - turn / 2 + rotation_vector_coefficient(vector @ vector) * jnp.cross(vector, turn)


def _solve3(matrix, right):
    """Solution of three equations by Cramer's rule."""
    a, b, c = matrix.T
    return jnp.stack([right @ jnp.cross(b, c), right @ jnp.cross(c, a), right @ jnp.cross(a, b)]) / (
        a @ jnp.cross(b, c)
    )
