"""Damping models (Rayleigh, modal, structural) and the complex modes of a viscously damped system."""

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
    """Rayleigh (proportional) damping matrix `C = by_mass M + by_stiffness K`, with factors [1/s] and [s]."""
    return by_mass * M + by_stiffness * K


def rayleigh_from_ratios(
    first: Sequence[Number] | AnyArray, second: Sequence[Number] | AnyArray
) -> tuple[Number, Number]:
    """Factors `(by_mass, by_stiffness)` of Rayleigh damping from damping ratios at two frequencies.

    Args: first, second: pairs (angular frequency [rad/s], damping ratio).

    Raises: ValueError for equal frequencies, if concrete.  Source: S1 (39).
    """
    (w1, z1), (w2, z2) = first, second
    if is_concrete(w1, w2) and np.any(np.asarray(w1) == np.asarray(w2)):
        raise ValueError(f"both ratios are given at the frequency {w1}: give two different frequencies")
    by_stiffness = 2 * (z2 * w2 - z1 * w1) / (w2**2 - w1**2)
    return 2 * z1 * w1 - by_stiffness * w1**2, by_stiffness


def modal_damping(*, K: AnyArray, M: AnyArray, ratios: ArrayLike) -> Array:
    """Damping matrix C (n, n) that gives the natural modes of (K, M) the given damping ratios, uncoupled.

    Args:
        ratios: one for all modes, or (n,) by rising frequency; equal ratios where frequencies are equal.

    Rigid modes stay undamped.  Value and first derivative are right at repeated frequencies.

    Raises: ValueError for negative stiffness, whose modes have no damping ratio, if concrete; under tracing the
    result is NaN.
    Source: S1 (40).
    """
    K, M = as_real(K), as_real(M)
    modes = lax.stop_gradient(stable_modes(K=K, M=M))
    moving = (~modes.is_rigid).astype(K.dtype) + 0.0 * modes.shapes[0]  # NaN where it is unstable
    return M @ spectral(_modal_rate, K, M, as_dtype(ratios, K.dtype), moving) @ M


def _modal_rate(values, ratios, moving):
    still = moving < 0.75  # `spectral` takes the mean of a pair: a half between a rigid and an elastic mode
    return jnp.where(still, 0.0, 2.0 * ratios * jnp.sqrt(jnp.where(still, 1.0, values)) * moving)


def modal_lag(*, K: AnyArray, M: AnyArray, ratios: ArrayLike, velocity: AnyArray) -> Array:
    """Displacements y (..., n) whose forces `K y` equal those of `modal_damping` at velocities (..., n)."""
    modes = lax.stop_gradient(stable_modes(K=K, M=M))
    moving = (~modes.is_rigid).astype(K.dtype)
    return velocity @ M @ spectral(_modal_time, K, M, jnp.asarray(ratios, K.dtype), moving)


def _modal_time(values, ratios, moving):
    still = moving < 0.75
    return jnp.where(still, 0.0, 2.0 * ratios * moving / jnp.sqrt(jnp.where(still, 1.0, values)))


def is_coupling_modes(C: AnyArray) -> Bool[Array, ""]:
    """True () if a damping matrix (n, n) in natural modes has off-diagonal terms above 1e3 roots of rounding.

    The terms are measured against the geometric mean of the two modes' own damping.
    """
    own, root = jnp.abs(jnp.diagonal(C)), jnp.finfo(C.dtype).eps ** 0.5
    size = jnp.sqrt(own[:, None] * own[None, :]) + root * jnp.max(own, initial=1e-30)
    return ~(jnp.max(jnp.abs(C - jnp.diag(jnp.diagonal(C))) / size, initial=0.0) <= 1e3 * root)  # also for NaN


def structural_damping(K: AnyArray, loss: Number) -> Complex[Array, "n n"]:
    """Complex stiffness `K (1 + i loss)` of structural (hysteretic) damping.

    Args: loss: loss factor, a number or (n, n), entry by entry.

    Raises: ValueError for a stiffness that is not square and, if concrete, for one that is unsymmetric or not finite.
    """
    check_symmetric(stiffness=K)
    return lax.complex(K, K * loss)


def complex_modes(*, K: AnyArray, C: AnyArray, M: AnyArray, diagonal: AnyArray | None = None) -> Modes:
    """All 2 n complex modes of `root^2 M x + root C x + K x = 0`, on the CPU.

    A complex K is structural damping, valid near real frequencies only.

    Args: diagonal: (n,) of the stiffness that K was condensed from, whose rounding it has; default K's own.

    Raises: ValueError for matrices of different shapes and, if concrete, coordinates without mass.  Source: S1 (39).
    """
    if not K.shape == C.shape == M.shape:
        raise ValueError(f"stiffness, damping and mass must be of one shape, not {K.shape}, {C.shape}, {M.shape}")
    check_mass(M)
    n = K.shape[0]
    dtype = np.result_type(K.dtype, C.dtype, M.dtype)
    both = square.solve(M, jnp.concatenate([jnp.eye(n, dtype=M.dtype), C], axis=1)).astype(dtype)
    S, D = both[:, :n], both[:, n:]
    of_stiffness = lambda K: jnp.block(
        [[jnp.zeros((n, n), dtype), jnp.eye(n, dtype=dtype)], [-S @ K.astype(dtype), -D]]
    )
    roots, X, Y = eig(of_stiffness(K))
    values = roots.real**2 + roots.imag**2
    rounding = eig_rounding(of_stiffness(K if diagonal is None else K + jnp.diag(diagonal)), X, Y)
    return Modes(values, X[:n], jnp.abs(roots) <= rounding, roots, Y[:, n:] @ S.astype(X.dtype), rounding)


def damped_frequency(omega: Number, ratio: Number) -> Array:
    """Damped angular frequency `w sqrt(1 - ratio^2)` [rad/s], zero from critical damping on.  Source: S1 (39)."""
    left = 1.0 - ratio**2
    return jnp.where(left <= 0, 0.0, jnp.sqrt(jnp.where(left <= 0, 1.0, left))) * omega
