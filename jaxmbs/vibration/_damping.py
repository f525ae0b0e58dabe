"""Damping: proportional, modal, structural; the complex modes of any viscous damping."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Complex

from ..checks import is_concrete
from ..elements._base import as_real
from ..linear._storage import Matrix
from ..linear._symmetric import check_mass, check_symmetric
from ..math import _square as square
from ..math._eigen import eig, eig_rounding, spectral
from ..runtime import as_dtype
from ..typing import AnyArray, ArrayLike, Number
from ._modes import Modes, stable_modes


def rayleigh_damping(
    *, K: Matrix | np.ndarray, M: Matrix | np.ndarray, by_mass: Number, by_stiffness: Number
) -> Matrix | np.ndarray:
    """`C = by_mass M + by_stiffness K`, [1/s] and [s]."""
    return by_mass * M + by_stiffness * K


def rayleigh_from_ratios(
    first: Sequence[Number] | AnyArray, second: Sequence[Number] | AnyArray
) -> tuple[Number, Number]:
    """`(by_mass, by_stiffness)` for damping ratios at two angular frequencies: pairs (frequency [rad/s], ratio).

    Raises: ValueError for equal frequencies, if concrete.  Source: S1 (39).
    """
    (w1, z1), (w2, z2) = first, second
    if is_concrete(w1, w2) and np.any(np.asarray(w1) == np.asarray(w2)):
        raise ValueError(f"two ratios at one frequency {w1}: give two frequencies")
    by_stiffness = 2 * (z2 * w2 - z1 * w1) / (w2**2 - w1**2)
    return 2 * z1 * w1 - by_stiffness * w1**2, by_stiffness


def modal_damping(*, K: AnyArray, M: AnyArray, ratios: ArrayLike) -> Array:
    """C (n, n) that damps the natural modes of (K, M) by given ratios and does not couple them.

    Args:
        ratios: one for all or one for each mode (n,) by rising frequency, then equal where frequencies are.

    Rigid modes stay undamped.  Right in value and first derivative at repeated frequencies.

    Raises: ValueError for negative stiffness, whose modes have no damping ratio, if concrete; else NaN.
    Source: S1 (40).
    """
    K, M = as_real(K), as_real(M)
    modes = lax.stop_gradient(stable_modes(K=K, M=M))
    moving = (~modes.is_rigid).astype(K.dtype) + 0.0 * modes.shapes[0]  # NaN where it is unstable
    return M @ spectral(_modal_rate, K, M, as_dtype(ratios, K.dtype), moving) @ M


def _modal_rate(values, ratios, moving):
    still = moving < 0.75  # between a rigid mode and another one it is a half
    return jnp.where(still, 0.0, 2.0 * ratios * jnp.sqrt(jnp.where(still, 1.0, values)) * moving)


def modal_lag(*, K: AnyArray, M: AnyArray, ratios: ArrayLike, velocity: AnyArray) -> Array:
    """Displacements (..., n) whose elastic forces `K y` are those of `modal_damping` at velocities (..., n)."""
    modes = lax.stop_gradient(stable_modes(K=K, M=M))
    moving = (~modes.is_rigid).astype(K.dtype)
    return velocity @ M @ spectral(_modal_time, K, M, jnp.asarray(ratios, K.dtype), moving)


def _modal_time(values, ratios, moving):
    still = moving < 0.75
    return jnp.where(still, 0.0, 2.0 * ratios * moving / jnp.sqrt(jnp.where(still, 1.0, values)))


def is_coupling_modes(C: AnyArray) -> Bool[Array, ""]:
    """() whether a damping in natural modes (n, n) couples them: by more than 1e3 roots of rounding of their own."""
    own, root = jnp.abs(jnp.diagonal(C)), jnp.finfo(C.dtype).eps ** 0.5
    size = jnp.sqrt(own[:, None] * own[None, :]) + root * jnp.max(own, initial=1e-30)
    return ~(jnp.max(jnp.abs(C - jnp.diag(jnp.diagonal(C))) / size, initial=0.0) <= 1e3 * root)  # also for NaN


def structural_damping(K: AnyArray, loss: Number) -> Complex[Array, "n n"]:
    """Complex stiffness `K (1 + i loss)`; loss is a number or (n, n), entry by entry.

    Raises: ValueError for a stiffness that is not square and, if concrete, unsymmetric or not finite.
    """
    check_symmetric(stiffness=K)
    return lax.complex(K, K * loss)


def complex_modes(*, K: AnyArray, C: AnyArray, M: AnyArray) -> Modes:
    """All 2 n complex modes of `root^2 M x + root C x + K x = 0`, on the CPU.

    K may be complex: structural damping, valid near real frequencies only.

    Raises: ValueError for matrices of different shapes and, if concrete, coordinates without mass.  Source: S1 (39).
    """
    if not K.shape == C.shape == M.shape:
        raise ValueError(f"stiffness, damping and mass differ in shape: {K.shape}, {C.shape}, {M.shape}")
    check_mass(M)
    n = K.shape[0]
    dtype = np.result_type(K.dtype, C.dtype, M.dtype)
    both = square.solve(M, jnp.concatenate([jnp.eye(n, dtype=M.dtype), C], axis=1)).astype(dtype)
    S, D = both[:, :n], both[:, n:]
    A = jnp.block([[jnp.zeros((n, n), dtype), jnp.eye(n, dtype=dtype)], [-S @ K.astype(dtype), -D]])
    roots, X, Y = eig(A)
    values = roots.real**2 + roots.imag**2
    rounding = eig_rounding(A, X, Y)
    return Modes(values, X[:n], jnp.abs(roots) <= rounding, roots, Y[:, n:] @ S.astype(X.dtype), rounding)


def damped_frequency(omega: Number, ratio: Number) -> Array:
    """`w sqrt(1 - ratio^2)` of omega [rad/s], zero from critical damping on.  Source: S1 (39)."""
    left = 1.0 - ratio**2
    return jnp.where(left <= 0, 0.0, jnp.sqrt(jnp.where(left <= 0, 1.0, left))) * omega
