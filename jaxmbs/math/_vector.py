"""Vectors in space: geometry of many points.

By their components, each an array of any shape, it is elementwise operations alone, which compile to one kernel,
unlike sums and products over a last axis of three.  As rows it takes a third of the equations, for small programs.
"""

from typing import NamedTuple, TypeAlias

import jax.numpy as jnp
from jax import Array, lax

from ..runtime import SMALL_PROGRAM
from . import _components as components
from ._linalg import CROSS


class VectorComponents(NamedTuple):
    """Components of vectors; operators treat them one by one, and `a * b` multiplies by a number for each vector."""

    x: Array
    y: Array
    z: Array

    @classmethod
    def of(cls, rows: Array) -> "Vectors":
        """From rows (..., 3); rows they stay in small programs."""
        return VectorRows(rows) if SMALL_PROGRAM.value else cls(*(rows[..., k] for k in range(3)))

    @property
    def rows(self) -> Array:
        """The vectors as rows (..., 3)."""
        return jnp.stack(self, axis=-1)

    def __add__(self, other):  # type: ignore[override]
        return VectorComponents(*components.add(self, other))

    def __sub__(self, other):
        return VectorComponents(*(a - b for a, b in zip(self, other, strict=True)))

    def __mul__(self, factor):  # type: ignore[override]
        return VectorComponents(*components.scale(self, factor))

    def __neg__(self):
        return VectorComponents(*(-a for a in self))


class VectorRows(NamedTuple):
    """The same as rows (..., 3) of one array."""

    rows: Array

    def __add__(self, other):  # type: ignore[override]
        return VectorRows(self.rows + other.rows)

    def __sub__(self, other):
        return VectorRows(self.rows - other.rows)

    def __mul__(self, factor):  # type: ignore[override]
        return VectorRows(self.rows * (factor[..., None] if jnp.ndim(factor) else factor))

    def __neg__(self):
        return VectorRows(-self.rows)


Vectors: TypeAlias = VectorComponents | VectorRows


def dot(a: Vectors, b: Vectors) -> Array:
    """Products of vectors."""
    if isinstance(a, VectorRows) or isinstance(b, VectorRows):
        return jnp.sum(a.rows * b.rows, axis=-1)
    return components.dot(a, b)


def cross(a: Vectors, b: Vectors) -> Vectors:
    """Vector products."""
    if isinstance(a, VectorRows) or isinstance(b, VectorRows):
        turned = jnp.tensordot(b.rows, jnp.asarray(CROSS, b.rows.dtype), ((-1,), (1,)))  # (..., 3, 3), of columns a
        return VectorRows(jnp.sum(turned * a.rows[..., None, :], axis=-1))
    return VectorComponents(*components.cross(a, b))


def norm(a: Vectors) -> Array:
    """Lengths, with zero derivative at zero."""
    square = dot(a, a)
    return jnp.where(square > 0, jnp.sqrt(jnp.where(square > 0, square, 1.0)), 0.0)


def norm_and_unit(a: Vectors) -> tuple[Array, Vectors]:
    """Both of the same root."""
    square = dot(a, a)
    positive = square > 0
    length = jnp.sqrt(jnp.where(positive, square, 1.0))
    return jnp.where(positive, length, 0.0), a * jnp.where(positive, 1.0 / length, 0.0)


def unit(a: Vectors) -> Vectors:
    """Unit vectors, zero at zero."""
    square = dot(a, a)
    return a * jnp.where(square > 0, lax.rsqrt(jnp.where(square > 0, square, 1.0)), 0.0)
