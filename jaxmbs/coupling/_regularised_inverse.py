"""Inverses of measured matrices: truncated, damped and weighted against noise, with derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..checks import any_concrete, negative
from ..runtime import as_dtype, lapack
from ..typing import ArrayLike


def regularised_inverse(
    A: ArrayLike,
    rank: int | None = None,
    rcond: ArrayLike = 0.0,
    noise: ArrayLike = 0.0,
    weights: ArrayLike | None = None,
) -> Array:
    """Pseudo-inverse `V g(s) U^H`, `g = s / (s^2 + noise^2)` for the singular values that are kept, else 0.

    Args:
        A: (..., rows, columns), real or complex.
        rank: how many singular values are kept; None is all.
        rcond: those below this share of the largest one are dropped.
        noise: standard deviation of the entries (Tikhonov's damping), in their unit; () or (...).
        weights: (rows,), one over the standard deviation of each row; the residual is weighed by it.

    The derivative is that of this function, not that of an inverse: it is right where truncation drops noise, and
    where singular values repeat.  It does not exist where the cut falls between equal ones.

    Returns: (..., columns, rows).

    Raises: ValueError for a rank that cannot be and, if concrete, rcond and noise that are not finite.
    Source: S1 (41).
    """
    A, most = jnp.asarray(A), min(np.shape(A)[-2:])
    if rank is not None and not 0 < rank <= most:
        raise ValueError(f"rank = {rank}: there are {most} singular values")
    for name, value in {"rcond": rcond, "noise": noise}.items():
        if any_concrete(lambda x: ~np.isfinite(x), value) or (name == "rcond" and negative(value)):
            raise ValueError(f"{name} must be finite, rcond not negative, got {value}")
    if weights is not None:
        weights = as_dtype(weights, A.real.dtype).astype(A.dtype)
        A = A * weights[(None,) * (A.ndim - 2) + (slice(None), None)]
    damping = jnp.broadcast_to(as_dtype(noise, A.real.dtype) ** 2, A.shape[:-2])
    inverse = _inverse(A, damping, most if rank is None else rank, rcond)
    return inverse if weights is None else inverse * weights[(None,) * (A.ndim - 2) + (None, slice(None))]


def _decompose(A, damping, rank, rcond):
    """U, s, V^H, g(s), 1 / (s^2 + a) of the kept values, and which are kept."""
    whole = lapack.svd
    for _ in A.shape[:-2]:
        whole = jax.vmap(whole)
    U, s, Vh = whole(A)
    kept = (s > rcond * s[..., :1]) & jnp.broadcast_to(np.arange(s.shape[-1]) < rank, s.shape) & (s > 0)
    size = s**2 + damping[..., None]
    h = jnp.where(kept, 1 / jnp.where(kept, size, 1.0), 0.0)
    return U, s, Vh, s * h, h, kept


def _assemble(parts):
    U, _, Vh, g, _, _ = parts
    return _adjoint((U * g[..., None, :].astype(U.dtype)) @ Vh)


def _adjoint(A):
    return jnp.conj(jnp.swapaxes(A, -1, -2))


def _inverse(A, damping, rank, rcond):
    @jax.custom_jvp
    def inverse(A, damping):
        return _assemble(_decompose(A, damping, rank, rcond))

    @inverse.defjvp
    def _(primals, tangents):
        (A, damping), (dA, da) = primals, tangents
        parts = _decompose(A, damping, rank, rcond)
        return _assemble(parts), _adjoint(_change(parts, damping, dA, da))

    return inverse(A, damping)


def _change(parts, damping, dA, da):
    """Change of `U g(s) V^H`, by divided differences of the odd function g on the dilation [0 A; A^H 0]."""
    U, s, Vh, g, h, kept = parts
    V = _adjoint(Vh)
    P = _adjoint(U) @ dA @ V
    si, sj, hi, hj = s[..., :, None], s[..., None, :], h[..., :, None], h[..., None, :]
    a = damping[..., None, None]
    both, one = kept[..., :, None] & kept[..., None, :], kept[..., :, None] ^ kept[..., None, :]
    gap = jnp.where(one, si - sj, 1.0)
    total = jnp.where(one, si + sj, 1.0)
    minus = jnp.where(both, (a - si * sj) * hi * hj, (si * hi - sj * hj) / gap)
    plus = jnp.where(both, (a + si * sj) * hi * hj, (si * hi + sj * hj) / total)
    minus, plus = (jnp.where(both | one, d, 0.0).astype(P.dtype) for d in (minus, plus))
    Ph = _adjoint(P)
    core = (minus * (P + Ph) + plus * (P - Ph)) / 2
    by_damping = (g * h * da[..., None]).astype(P.dtype)
    core = core - jnp.where(np.eye(s.shape[-1], dtype=bool), by_damping[..., None, :], 0.0)
    hc = h[..., None, :].astype(P.dtype)
    left = (dA @ V - U @ P) * hc
    right = (_adjoint(dA) @ U - V @ Ph) * hc
    return (U @ core + left) @ Vh + U @ _adjoint(right)
