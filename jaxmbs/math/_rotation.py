"""Rotations in space: quaternions (w, x, y, z), rotation vectors and matrices, with finite derivatives.

A rotation matrix of shape (3, 3) takes components in the turned axes to components in the fixed axes.
Angles in rad. Functions take single rotations; map them with `jax.vmap`.
"""

import functools
import math
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..checks import is_concrete
from ..runtime import as_array
from ..typing import Axis, Matrix3, Quaternion, Scalar, Vector3

_NAMED_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def quaternion_matrix(q: Quaternion) -> Matrix3:
    """Rotation matrix of a quaternion of any length but zero (the length cancels)."""
    w, x, y, z = q
    rows = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return _matrix(*rows) / jnp.dot(q, q)


def quaternion_product(p: Quaternion, q: Quaternion) -> Quaternion:
    """Hamilton product: the rotation q followed, in fixed axes, by the rotation p."""
    scalar = p[0] * q[0] - jnp.dot(p[1:], q[1:])
    vector = p[0] * q[1:] + q[0] * p[1:] + jnp.cross(p[1:], q[1:])
    return jnp.concatenate([scalar[None], vector])


def quaternion_rate(q: Quaternion, omega_body: Vector3) -> Quaternion:
    """Time derivative of a quaternion, 1/2 q (0, omega), from the angular velocity in turned axes [rad/s]."""
    return 0.5 * quaternion_product(q, jnp.concatenate([jnp.zeros_like(omega_body[:1]), omega_body]))


def quaternion_exp(vector: Vector3) -> Quaternion:
    """Unit quaternion of a rotation vector (axis times angle [rad])."""
    half = 0.5 * vector
    cosine, sine_ratio = _cosine_and_sine_ratio(jnp.dot(half, half))
    return jnp.concatenate([cosine[None], sine_ratio * half])


def quaternion_log(q: Quaternion) -> Vector3:
    """Rotation vector [rad] of a quaternion of any length but zero; its angle lies in [0, pi]."""
    q = jnp.where(q[0] < 0, -q, q)
    return _twice_angle_ratio(jnp.dot(q[1:], q[1:]), q[0]) * q[1:]


def rotation_matrix(vector: Vector3) -> Matrix3:
    """Rotation matrix of a rotation vector (axis times angle [rad])."""
    return quaternion_matrix(quaternion_exp(vector))


def rotation_vector(matrix: Matrix3) -> Vector3:
    """Rotation vector [rad] of a rotation matrix; its angle lies in [0, pi], its derivatives are finite."""
    return quaternion_log(matrix_quaternion(matrix))


def rotation_vector_rate(vector: Vector3, omega: Vector3) -> Vector3:
    """Rate of a rotation vector that turns with angular velocity omega in fixed axes [rad/s], below half a turn.

    `omega - v x omega / 2 + b v x (v x omega)`.
    """
    turn = jnp.cross(vector, omega)
    return omega - turn / 2 + rotation_vector_coefficient(vector @ vector) * jnp.cross(vector, turn)


def rotation_vector_coefficient(square: Scalar) -> Scalar:
    """`(1 - h cot h) / angle^2` with `h = angle / 2`, from the squared angle; smooth at zero."""
    small = square < 0.04
    series = 1 / 12 + square * (1 / 720 + square * (1 / 30240 + square * (1 / 1209600 + square / 47900160)))
    half = jnp.sqrt(jnp.where(small, 1.0, square)) / 2
    return jnp.where(small, series, (1 - half / jnp.tan(half)) / (4 * half**2))


def matrix_quaternion(matrix: Matrix3) -> Quaternion:
    """Unit quaternion, w >= 0, of a rotation matrix.

    Each row of 4 q q^T is linear in the matrix; the row of the largest diagonal entry is never short, so that
    values and derivatives are good at every angle.
    """
    (a, b, c), (d, e, f), (g, h, i) = matrix
    rows = [
        [1 + a + e + i, h - f, c - g, d - b],
        [h - f, 1 + a - e - i, b + d, c + g],
        [c - g, b + d, 1 - a + e - i, f + h],
        [d - b, c + g, f + h, 1 - a - e + i],
    ]
    outer = _matrix(*rows)
    q = outer[jnp.argmax(jnp.diagonal(outer))]
    q = q / jnp.linalg.norm(q)
    return jnp.where(q[0] < 0, -q, q)


def axis_vector(axis: Axis) -> Vector3:
    """Unit vector of an axis: "x", "-y", "+z", ... or three numbers of any length but zero.

    Raises:
        ValueError: for an unknown name or a wrong shape.
    """
    if isinstance(axis, str):
        name = axis.removeprefix("+").removeprefix("-")
        if name not in _NAMED_AXES:
            raise ValueError(f"axis {axis!r} is not one of x, y, z, -x, -y, -z or three numbers")
        return jnp.asarray(np.array(_NAMED_AXES[name]) * (-1.0 if axis.startswith("-") else 1.0) + 0.0, float)
    vector = jnp.stack([as_array(part) for part in axis])
    if vector.shape != (3,):
        raise ValueError(f"an axis has three components, not the shape {vector.shape}")
    return vector / jnp.linalg.norm(vector)


def axis_basis(axis: Vector3) -> Matrix3:
    """Right-handed rotation whose third column is the normalised axis.

    Coordinate axes give exact permutations (with signs), z the identity. The first column lies nearest to the
    coordinate axis that follows the largest component of the axis in the order x, y, z, x: the basis jumps
    where another component becomes the largest, and its derivatives are finite for every axis but zero.
    """
    # known numbers in NumPy: a build on the host compiles nothing
    xp, axis = (np, np.asarray(axis)) if is_concrete(axis) else (jnp, axis)
    third = axis / xp.linalg.norm(axis)
    helper = xp.eye(3, dtype=axis.dtype)[(xp.argmax(xp.abs(axis)) + 1) % 3]
    first = helper - xp.dot(helper, third) * third
    first = first / xp.linalg.norm(first)
    return as_array(xp.stack([first, xp.cross(third, first), third], axis=1), None)


def _matrix(*rows: list) -> Array:
    return jnp.stack([jnp.stack(row) for row in rows])


def _series(coefficients: list[Any], argument: Scalar) -> Scalar:
    """Polynomial by Horner's rule, lowest order first."""
    return functools.reduce(lambda total, c: total * argument + c, reversed(coefficients))


def _cosine_and_sine_ratio(square: Scalar) -> tuple[Scalar, Scalar]:
    """cos(r) and sin(r)/r as smooth functions of r^2."""
    small = square < 0.1
    coefficients = [(-1.0) ** (n // 2) / math.factorial(n) for n in range(20)]
    near = jnp.where(small, square, 0.0)
    root = jnp.sqrt(jnp.where(small, 1.0, square))
    cosine = jnp.where(small, _series(coefficients[0::2], near), jnp.cos(root))
    return cosine, jnp.where(small, _series(coefficients[1::2], near), jnp.sin(root) / root)


def _twice_angle_ratio(square: Scalar, w: Scalar) -> Scalar:
    """2 atan2(n, w) / n as a smooth function of n^2, for w >= 0."""
    small = square < 0.01 * w * w
    near_w = jnp.where(small, w, 1.0)
    tangent_square = jnp.where(small, square, 0.0) / (near_w * near_w)
    root = jnp.sqrt(jnp.where(small, 1.0, square))
    series = _series([(-1.0) ** n / (2 * n + 1) for n in range(10)], tangent_square)
    return 2.0 * jnp.where(small, series / near_w, jnp.arctan2(root, w) / root)
