"""Conversions between rotation matrices, quaternions, rotation vectors, and an axis with an angle.

A matrix (..., 3, 3) takes components in the turned axes to components in the fixed ones, as those of `rotation=` and
of `rotation(system, state, frame)` do.  A quaternion (..., 4) is (w, x, y, z), as the coordinates of `Spherical` and
`Free` joints are; q and -q are one rotation.  A rotation vector (..., 3) is the axis times the angle [rad],
right-handed. Everything has derivatives, at no rotation too.  Leading axes go through.

Raises (all of them): ValueError for another shape and, where the numbers are known, for what is no rotation.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..arguments import explain_arguments
from ..checks import any_concrete, are_axes, require_reals
from ..math import _rotation as single
from ..runtime import as_array
from ..typing import ArrayLike, Axis

_ZERO_LENGTH = 1e-12  # of a quaternion: shorter ones have no direction beyond rounding


def from_quaternion(quaternion: ArrayLike) -> Float[Array, "... 3 3"]:
    """Matrix of a quaternion (..., 4), w first, of any length but zero."""
    q = _numbers("a quaternion", quaternion, (4,))
    if any_concrete(lambda q: np.linalg.norm(q, axis=-1) < _ZERO_LENGTH, q):
        raise ValueError("a quaternion of length zero is not a rotation")
    return jnp.vectorize(single.quaternion_matrix, signature="(q)->(i,j)")(q)


def from_vector(vector: ArrayLike) -> Float[Array, "... 3 3"]:
    """Matrix of a rotation vector (..., 3), axis times angle [rad]."""
    return jnp.vectorize(single.rotation_matrix, signature="(v)->(i,j)")(_numbers("a rotation vector", vector, (3,)))


def from_axis_angle(axis: Axis, angle: ArrayLike) -> Float[Array, "... 3 3"]:
    """Matrix of the rotation by an angle (...) [rad] about an axis: "x", "-y", or three numbers of any length."""
    axis = single.axis_vector(axis)
    if any_concrete(lambda n: ~np.isfinite(n), axis):
        raise ValueError("the axis has no direction (zero or not finite)")
    angle = _numbers("an angle", angle, ())[..., None]
    return from_vector(angle * jnp.broadcast_to(axis, (*angle.shape[:-1], 3)))


def to_quaternion(rotation: ArrayLike) -> Float[Array, "... 4"]:
    """Unit quaternion (w, x, y, z) of a matrix (..., 3, 3), w >= 0: what `State.at` takes for a ball joint."""
    return jnp.vectorize(single.matrix_quaternion, signature="(i,j)->(q)")(_matrix(rotation))


def to_vector(rotation: ArrayLike) -> Float[Array, "... 3"]:
    """Rotation vector [rad] of a matrix (..., 3, 3): its length is the angle, at most pi, its direction the axis."""
    return jnp.vectorize(single.rotation_vector, signature="(i,j)->(v)")(_matrix(rotation))


def _matrix(rotation):
    matrix = _numbers("a rotation", rotation, (3, 3))
    if not are_axes(matrix):
        raise ValueError("it is not a rotation matrix: its rows must be unit vectors, at right angles, right-handed")
    return matrix


def _numbers(what, value, shape):
    """An array whose last axes are `shape`, finite where known."""
    require_reals(value)
    value = as_array(value)
    if value.shape[value.ndim - len(shape) :] != shape:
        raise ValueError(f"{what} has the shape (..., {', '.join(map(str, shape))}), not {value.shape}")
    if any_concrete(lambda x: ~np.isfinite(x), value):
        raise ValueError(f"{what} must be finite")
    return value


explain_arguments(globals())
