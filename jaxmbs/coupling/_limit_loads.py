"""Limit loads of a payload from pairs of modes, each pair with a closed-form response to an impulse."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import any_concrete, is_concrete, not_positive, require_numbers, require_reals
from ..math._eigen import eigh
from ..math._extremes import largest
from ..quantities import entries
from ..reductions._base import Reduced
from ..reports import Report, Reported, reported
from ..runtime import as_array, as_dtype, jit
from ..typing import AnyArray, ArrayLike
from ..vibration._oscillator_motion import Oscillators
from ..vibration._oscillator_peaks import peaks


class ModalPairs(Reported, eqx.Module):
    """Two-mass systems of every mode i of the carrier, free or loaded, with every cantilevered mode j of the payload.

    Attributes:
        mass: (i, j, 2, 2), `[[1 + mu_i, m_ij], [m_ij, 1]]`; of loaded modes `[[1, m_ij], [m_ij, 1]]`.
        stiffness: (i, j, 2, 2), `diag(w_Bi^2, w_Pj^2)`.
    """

    mass: Float[Array, "i j 2 2"]
    stiffness: Float[Array, "i j 2 2"]

    def report(self) -> Report:
        omega, _ = self.modes()
        return Report(
            [entries("frequency", np.asarray(omega) / (2 * np.pi), "Hz"), entries("mass", self.mass, "kg/kg")]
        )

    def modes(self) -> tuple[Array, Array]:
        """Angular frequencies (i, j, 2) [rad/s] and shapes (i, j, 2, 2) of all pairs."""
        values, shapes = jax.vmap(jax.vmap(eigh))(self.stiffness, self.mass)
        floor = 1e3 * jnp.finfo(values.dtype).eps * values[..., 1:]
        rigid = values <= floor
        return jnp.where(rigid, 0.0, jnp.sqrt(jnp.where(rigid, 1.0, values))), shapes

    def response(self, impulses: ArrayLike, t: ArrayLike) -> Array:
        """Impulse response `q_P(t) = J sum_k X_1k X_2k sin(w_k t) / w_k` (i, j) of the payload at a time t [s].

        Args: impulses: J (i,) on the modes of the carrier.

        Source: S1 (32).
        """
        gain, w = self._gains()
        return jnp.asarray(impulses)[:, None] * jnp.sum(gain * jnp.sin(w * t), axis=-1)

    def peaks(self, impulses: ArrayLike) -> Array:
        """Bounds `|J| sum_k |X_1k X_2k| / w_k` (i, j) of `response`, reached if both terms peak at one time.

        Source: S1 (32).
        """
        gain, _ = self._gains()
        return jnp.abs(jnp.asarray(impulses))[:, None] * jnp.sum(jnp.abs(gain), axis=-1)

    def signs(self, impulses: ArrayLike) -> Array:
        """Initial signs (i, j) of the responses, those of `-J m_ij`, for "cqc".  Source: S1 (32)."""
        return -jnp.sign(jnp.asarray(impulses)[:, None] * self.mass[..., 0, 1])

    def _gains(self):
        w, X = self.modes()
        moving = w > 0
        return jnp.where(moving, X[..., 0, :] * X[..., 1, :] / jnp.where(moving, w, 1.0), 0.0), w


def modal_pairs(
    carrier_omega: ArrayLike, carrier_at_interface: ArrayLike, payload: Reduced, loaded: bool = False
) -> ModalPairs:
    """Pairs of a carrier's modes and the modes of a payload reduced by `CraigBampton` on a determinate interface.

    Args:
        carrier_omega: (i,) [rad/s].
        carrier_at_interface: (b, i), mass-normalised shapes at the interface coordinates of the payload.
        payload: its interface must be statically determinate (`T^T K T = 0`).
        loaded: True for modes of the carrier with the payload as a rigid body: their unit modal mass contains mu_i.

    `mu_i` is the rigid-body mass of the payload in mode i, `m_ij` its coupling with mode j of the payload.

    Raises: ValueError for a payload, if concrete, whose interface is not determinate, and for loaded modes whose
    modal mass is less than the contribution of the payload.  Source: S1 (32).
    """
    b = payload.num_interface
    _check_determinate(payload)
    phi, w_P = jnp.asarray(carrier_at_interface), jnp.diagonal(payload.stiffness)[b:]
    mu = jnp.sum(phi * (payload.mass[:b, :b] @ phi), axis=0)
    m = phi.T @ payload.mass[:b, b:]
    one = jnp.ones_like(m)
    if loaded and any_concrete(lambda mu: mu > 1 + 1e-9, mu):
        raise ValueError(
            "loaded=True, but the modal mass is less than the payload's contribution: "
            "these are modes of the carrier alone"
        )
    own = one if loaded else one + mu[:, None]
    mass = jnp.stack([jnp.stack([own, m], -1), jnp.stack([m, one], -1)], -2)
    values = jnp.stack([jnp.asarray(carrier_omega)[:, None] ** 2 * one, w_P[None, :] * one], -1)
    return ModalPairs(mass, values[..., None] * jnp.eye(2, dtype=m.dtype)[None, None])


def _check_determinate(payload):
    b, K = payload.num_interface, payload.stiffness
    if not is_concrete(K) or K.shape[0] == b:
        return
    K = np.abs(np.asarray(K))
    if np.max(K[:b, :b]) > 1e-6 * np.max(K):
        raise ValueError("the payload's interface is not statically determinate: moving it strains the payload")


def peak_response(omega: ArrayLike, force: ArrayLike, step: ArrayLike, ratio: ArrayLike = 0.0) -> Float[Array, ""]:
    """Peak `|q|` () of `q'' + 2 ratio omega q' + omega^2 q = f` from rest, with f linear between samples.

    Args: omega: [rad/s]; force: f (times,); step: time between samples [s]; ratio: damping ratio.

    The peak is that of the exact motion, between the samples too, if there are two or more of them in a period and
    the damping is at most critical; else that at quarters of the steps.  A `vmap` over omega gives a shock spectrum.

    Raises: ValueError, if concrete, for a step that is not positive.
    Source: S1 (32).
    """
    force = as_array(force)
    require_reals(force)
    if not_positive(step):
        raise ValueError(f"step = {step} must be positive")
    w, h, ratio = (as_dtype(x, force.dtype) for x in (omega, step, ratio))
    given = (w**2, 2 * ratio * w, jnp.ones_like(w), jnp.zeros_like(w))
    high, low = peaks(force, h, Oscillators(*(x[None] for x in given)))[0][:, 0]
    return jnp.maximum(high, -low)


def equivalent_impulse(omega: ArrayLike, peak: ArrayLike) -> Array:
    """Equivalent impulse `J = omega |q|_max` on a mode of omega [rad/s] from its peak response.  Source: S1 (32)."""
    require_numbers(omega=omega, peak=peak)
    return jnp.asarray(omega) * jnp.asarray(peak)


def combine_modal_maxima(
    values: AnyArray,
    how: str = "srss",
    weights: AnyArray | None = None,
    axis: int = 0,
    correlation: AnyArray | None = None,
) -> Array:
    """Combine modal maxima along an axis.

    Args:
        how: "abs" sum of magnitudes, "srss" root of the sum of squares, "cqc" complete quadratic combination.
        weights: (m,) of the terms.
        correlation: (m, m), for "cqc".

    The result is an estimate, a bound only for "abs".  Source: S1 (32).
    """
    require_numbers(values=values)
    moved = jnp.moveaxis(values, axis, 0)
    if weights is not None:
        moved = moved * weights.reshape(-1, *[1] * (moved.ndim - 1))
    if how == "abs":
        return jnp.sum(jnp.abs(moved), axis=0)
    if how == "srss":
        return _safe_sqrt(jnp.sum(moved**2, axis=0))
    if how == "cqc" and correlation is not None:
        return _safe_sqrt(jnp.sum(moved * jnp.tensordot(correlation, moved, axes=1), axis=0))
    raise ValueError(f'how = {how!r} must be "abs", "srss" or, with a correlation, "cqc"')


@jit
def cqc_correlation(omega: ArrayLike, ratios: ArrayLike) -> Float[Array, "m m"]:
    """Correlation (m, m) of modal peaks for white excitation (Der Kiureghian 1981).

    Args: omega (m,) [rad/s]; ratios of damping (m,).  Source: S1 (32), its sum in the rms sense.
    """
    omega, ratios = jnp.asarray(omega), jnp.asarray(ratios)
    r = omega[:, None] / omega[None, :]
    a, b = ratios[:, None], ratios[None, :]
    top = 8 * jnp.sqrt(a * b) * (a * r + b) * r**1.5
    return top / ((1 - r**2) ** 2 + 4 * a * b * r * (1 + r**2) + 4 * (a**2 + b**2) * r**2)


def limit_loads(
    recovery: ArrayLike,
    peaks: ArrayLike,
    how: str = "srss",
    weights: ArrayLike | None = None,
    correlation: tuple[ArrayLike, ArrayLike] | None = None,
) -> Float[Array, " k"]:
    """Limit values (k,) of element responses `recovery` (k, j) of the payload's modes, peaks (i, j) of the pairs.

    The sum goes over all pairs.

    Args:
        how: as in `combine_modal_maxima`.
        weights: (j,) of the payload's modes, or (i, j) of the pairs.
        correlation: for "cqc", of the carrier's modes (i, i) and of the payload's (j, j), as `cqc_correlation` gives
            them; peaks then carry their signs, `pairs.peaks(impulses) * pairs.signs(impulses)`.

    Source: S1 (32).
    """
    recovery = jnp.asarray(recovery)
    values = recovery[:, None, :] * jnp.asarray(peaks)[None]
    if weights is not None:
        w = as_dtype(weights, values.dtype)
        values = values * (w[None, None, :] if w.ndim == 1 else w[None])
    whole = None if correlation is None else jnp.kron(*map(jnp.asarray, correlation))
    return combine_modal_maxima(values.reshape(len(recovery), -1), how, axis=1, correlation=whole)


@reported
class Shortfall(NamedTuple):
    """Frequency and size of the shortfall of limit values against true peaks.

    Attributes:
        share: fraction of the cases that fall short, 0 to 1.
        worst, mean: `1 - limit / truth`, the largest and the mean of those that fall short; 0 where none does.
        quotient: `limit / truth` of every case.
    """

    share: Array
    worst: Array
    mean: Array
    quotient: Array

    def report(self) -> Report:
        return Report([entries(name, values) for name, values in zip(self._fields, self, strict=True)])


def truncation_shortfall(limits: ArrayLike, truth: ArrayLike) -> Shortfall:
    """Compare limit values (cases, ...) with peaks of the full transient (cases, ...).

    Source: S1 (32).
    """
    require_numbers(limits=limits, truth=truth)
    quotient = jnp.asarray(limits) / jnp.asarray(truth)
    short = jnp.maximum(1.0 - quotient, 0.0)
    count = jnp.sum(short > 0, axis=0).astype(quotient.dtype)
    mean = jnp.sum(short, axis=0) / jnp.maximum(count, 1.0)
    return Shortfall(count / len(quotient), largest(short, 0), mean, quotient)


def _safe_sqrt(square):
    none = square <= 0  # false for NaN, which must not count as no load
    return jnp.where(none, 0.0, jnp.sqrt(jnp.where(none, 1.0, square)))
