"""Inertia matrices of simple homogeneous bodies about their centres of mass, and of bodies made of parts.

Masses in kg, lengths in m, inertias in kg m^2. Every number may be traced. `axis` is the axis of symmetry:
"x", "y", "z" or three numbers in body axes.
"""

from collections.abc import Iterable, Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..arguments import explain_arguments
from ..checks import any_concrete, are_axes, is_concrete, negative, require_reals
from ..math._rotation import axis_vector
from ..runtime import as_array
from ..typing import AnyArray, ArrayLike, Axis, Matrix3, ScalarLike


def point() -> Matrix3:
    """Inertia of a point mass: zero."""
    return as_array(np.zeros((3, 3)))


def rod(mass: ScalarLike, length: ScalarLike, axis: Axis = "x") -> Matrix3:
    """Inertia of a thin straight rod along `axis`."""
    _check(mass=mass, length=length)
    return _axisymmetric(0.0, mass * length**2 / 12, axis)


def box(mass: ScalarLike, size: Sequence[ScalarLike] | AnyArray) -> Matrix3:
    """Inertia of a solid box with the edges `size` (3,) along x, y, z."""
    if len(size) != 3:
        raise ValueError(f"a box has three edges, got {len(size)}")
    _check(mass=mass, x=size[0], y=size[1], z=size[2])
    xp, mass, *size = _as_arrays(mass, *size)
    squares = xp.stack([edge**2 for edge in size])
    return as_array(xp.diag(xp.sum(squares) - squares) * (mass / 12))


def cylinder(mass: ScalarLike, radius: ScalarLike, length: ScalarLike, axis: Axis = "z") -> Matrix3:
    """Inertia of a solid cylinder (a disc when it is short)."""
    return tube(mass, 0.0, radius, length, axis)


def tube(
    mass: ScalarLike, inner_radius: ScalarLike, outer_radius: ScalarLike, length: ScalarLike, axis: Axis = "z"
) -> Matrix3:
    """Inertia of a hollow cylinder; equal radii make a thin shell without end caps."""
    _check(mass=mass, inner_radius=inner_radius, outer_radius=outer_radius, length=length)
    squares = inner_radius**2 + outer_radius**2
    return _axisymmetric(mass * squares / 2, mass * (squares / 4 + length**2 / 12), axis)


def sphere(mass: ScalarLike, radius: ScalarLike) -> Matrix3:
    """Inertia of a solid sphere."""
    _check(mass=mass, radius=radius)
    return as_array(np.eye(3) * (mass * radius**2 * 0.4))


def spherical_shell(mass: ScalarLike, radius: ScalarLike) -> Matrix3:
    """Inertia of a thin spherical shell."""
    _check(mass=mass, radius=radius)
    return as_array(np.eye(3) * (mass * radius**2 * (2 / 3)))


def rotate(inertia: ArrayLike, rotation: ArrayLike) -> Matrix3:
    """Inertia in other axes: `rotation` takes components in the axes of `inertia` to the new ones."""
    rotation = jnp.asarray(rotation)
    if not are_axes(rotation):
        raise ValueError("the rotation is not a rotation matrix")
    return rotation @ as_matrix(inertia) @ rotation.T


def combine(parts: Iterable[tuple]) -> dict[str, Array]:
    """Mass, centre of mass and inertia of one body made of parts.

    Args:
        parts: tuples (mass, com, inertia), with the part's centre of mass `com` (3,) in body axes and its
            inertia about that centre in body axes: 0 (point mass), (3,) principal values or (3, 3). A part of
            negative mass and inertia cuts a hole.

    Returns:
        `mass` (), `com` (3,) and `inertia` (3, 3) about `com`, to be splatted into `SystemBuilder.body`.

    Raises:
        ValueError: without any part.
    """
    parts = [(as_array(m), as_array(c), as_matrix(inertia)) for m, c, inertia in parts]
    if not parts:
        raise ValueError("combine needs at least one part")
    if any(m.shape != () or c.shape != (3,) for m, c, _ in parts):
        raise ValueError("each part is (mass, centre of three numbers, inertia)")
    xp, *numbers = _as_arrays(*(number for part in parts for number in part))
    parts = list(zip(numbers[0::3], numbers[1::3], numbers[2::3], strict=True))
    mass = sum(m for m, _, _ in parts)
    com = sum(m * c for m, c, _ in parts) / mass
    inertia = sum(inertia + m * _parallel_axis_term(xp, c - com) for m, c, inertia in parts)
    return {"mass": as_array(mass), "com": as_array(com), "inertia": as_array(inertia)}


def as_matrix(inertia: ArrayLike | Sequence) -> Matrix3:
    """Inertia (3, 3) from 0 (point mass), (3,) principal values or (3, 3).

    Raises:
        ValueError: for any other shape.
    """
    require_reals(inertia)
    xp, inertia = _as_arrays(inertia)
    if inertia.shape not in ((), (3,), (3, 3)):
        raise ValueError(f"an inertia is 0, (3,) or (3, 3), not of shape {inertia.shape}")
    return as_array(xp.diag(inertia * xp.ones(3)) if inertia.ndim < 2 else inertia)


def _check(mass, **lengths):
    """Raises: ValueError for concrete numbers that are invalid; the mass of a hole may be negative."""
    for name, value in {"mass": mass, **lengths}.items():
        require_reals(value)
        if (
            np.shape(value) != ()
            or any_concrete(lambda x: ~np.isfinite(x), value)
            or (name != "mass" and negative(value))
        ):
            raise ValueError(
                f"{name} must be one finite number{'' if name == 'mass' else ', not negative'}, got {value}"
            )


def _axisymmetric(axial: ScalarLike, transverse: ScalarLike, axis: Axis) -> Matrix3:
    direction = axis_vector(axis)
    _, axial, transverse, direction = _as_arrays(axial, transverse, direction)
    outer = direction[:, None] * direction[None]
    return as_array(transverse * np.eye(3) + (axial - transverse) * outer)


def _as_arrays(*numbers) -> tuple:
    """NumPy or jax.numpy and the numbers as its arrays: NumPy where all are concrete, which compiles nothing."""
    xp = np if is_concrete(numbers) else jnp
    return xp, *(xp.asarray(number, float) for number in numbers)


def _parallel_axis_term(xp, c) -> AnyArray:
    """Inertia of a unit point mass at c."""
    return xp.dot(c, c) * np.eye(3) - xp.outer(c, c)


explain_arguments(globals())
