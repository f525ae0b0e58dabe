"""Measures of stress tensors (..., 6), in the order xx yy zz xy yz zx, with derivatives at no stress too."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..runtime import lapack

Tensors = Float[Array, "... 6"]


def von_mises(stress: Tensors) -> Float[Array, "..."]:
    """Equivalent stress of von Mises; its derivative at no stress is zero."""
    normal, shear = stress[..., :3], stress[..., 3:]
    differences = normal - jnp.roll(normal, -1, axis=-1)
    square = jnp.sum(differences**2, axis=-1) / 2 + 3 * jnp.sum(shear**2, axis=-1)
    acts = square > 0.0
    return jnp.where(acts, jnp.sqrt(jnp.where(acts, square, 1.0)), 0.0)


def signed_von_mises(stress: Tensors) -> Float[Array, "..."]:
    """Equivalent stress of von Mises with the sign of the sum of the normal stresses: negative in compression."""
    size = von_mises(stress)
    return jnp.where(jnp.sum(stress[..., :3], axis=-1) < 0.0, -size, size)


def principal(stress: Tensors) -> Float[Array, "... 3"]:
    """Principal stresses, falling; of equal ones a derivative lies between those of the parts."""
    return _principal(stress.reshape(-1, 6)).reshape(*stress.shape[:-1], 3)


@jax.custom_jvp
def _principal(stress):
    return lapack.eigh(_matrices(stress))[0][:, ::-1]


@_principal.defjvp
def _principal_jvp(primals, tangents):
    (stress,), (change,) = primals, tangents
    values, vectors = lapack.eigh(_matrices(stress))
    slopes = jnp.einsum("nik,nij,njk->nk", vectors, _matrices(change), vectors)
    return values[:, ::-1], slopes[:, ::-1]


def _matrices(stress):
    """Matrices (n, 3, 3) of tensors (n, 6)."""
    xx, yy, zz, xy, yz, zx = stress.T
    rows = [jnp.stack(row, axis=-1) for row in ((xx, xy, zx), (xy, yy, yz), (zx, yz, zz))]
    return jnp.stack(rows, axis=-2)
