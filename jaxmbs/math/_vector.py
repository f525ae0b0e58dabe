"""Vectors in space by their components, each an array of any shape: geometry of many points in elementwise operations
alone, which compile to one kernel, unlike sums and products over a last axis of three."""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array, lax


class Components(NamedTuple):
    """Components of vectors; operators treat them one by one, and `a * b` multiplies by a number for each vector."""

    x: Array
    y: Array
    z: Array

    @classmethod
    def of(cls, rows: Array) -> "Components":
        """From rows (..., 3)."""
        return cls(*(rows[..., k] for k in range(3)))

    @property
    def rows(self) -> Array:
        """The vectors as rows (..., 3)."""
        return jnp.stack(self, axis=-1)

    def __add__(self, other):  # type: ignore[override]
        return Components(*(a + b for a, b in zip(self, other, strict=True)))

    def __sub__(self, other):
        return Components(*(a - b for a, b in zip(self, other, strict=True)))

    def __mul__(self, factor):  # type: ignore[override]
        return Components(*(a * factor for a in self))

    def __neg__(self):
        return Components(*(-a for a in self))


def dot(a: Components, b: Components) -> Array:
    """Products of vectors."""
    return a.x * b.x + a.y * b.y + a.z * b.z


def cross(a: Components, b: Components) -> Components:
    """Vector products."""
    return Components(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


def norm(a: Components) -> Array:
    """Lengths, with zero derivative at zero."""
    square = dot(a, a)
    return jnp.where(square > 0, jnp.sqrt(jnp.where(square > 0, square, 1.0)), 0.0)


def unit(a: Components) -> Components:
    """Unit vectors, zero at zero."""
    square = dot(a, a)
    return a * jnp.where(square > 0, lax.rsqrt(jnp.where(square > 0, square, 1.0)), 0.0)
