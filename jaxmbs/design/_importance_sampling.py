"""Importance sampling about design points, with its confidence."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from scipy.special import logsumexp

from ..probability import RandomVariables
from ..runtime import jit
from ._design_point import DesignPoint
from ._parameter_slopes import log_density, named_slopes, parameter_slopes

_ELSEWHERE = 0.2  # share of samples that look for failures away from the design points
_NORMAL_95 = 1.959963984540054  # standard normal number of the two-sided 95 % interval
NORMAL_999 = 3.290526731491896  # and of the 99.9 % interval


def importance_sampling(
    traced: Any, variables: RandomVariables, points: DesignPoint, question: Any, slopes: bool = True
) -> dict:
    """Probability by normal samples about the design points, as fields of a result; what has no number fails.

    slopes: with its derivatives.

    A fifth of them spreads over all directions at the distance of the design points: failures elsewhere then have
    their part in the probability and in its error, where samples about the points alone would hardly ever meet them.
    Derivatives are by the density of the samples that fail (the score), without gradients of the limit state.

    Source: Melchers 1989, Importance sampling in structural systems; Hesterberg 1995, Weighted average importance
    sampling and defensive mixture distributions.
    """
    rng = np.random.default_rng(question.seed)
    number = question.samples
    centres, spreads, shares = _mixture(_centres(points, question.system))
    which = rng.choice(len(shares), size=number, p=shares)
    u = centres[which] + spreads[which, None] * rng.normal(size=(number, centres.shape[1]))
    values = traced.sampled(u, variables, question.compile, number)
    is_failure = failures(values, question.system)
    log_ratio = -0.5 * np.sum(u**2, axis=1) - _log_density(u, centres, spreads, shares)
    ratio = np.exp(log_ratio)
    # what fails nearly always is counted by what holds: its own samples have the larger errors
    holds = float(np.std(ratio * ~is_failure)) < float(np.std(ratio * is_failure))
    sign, counted = (-1.0, ~is_failure) if holds else (1.0, is_failure)
    weights = np.where(counted, ratio, 0.0)
    probability, error = float(np.mean(weights)), float(np.std(weights, ddof=1) / np.sqrt(number))
    few = [] if error < 0.3 * probability else [_FEW]
    probability = 1.0 - probability if holds else probability
    lost = int(np.sum(~np.all(np.isfinite(values), axis=1)))
    score = lambda: score_slopes(variables, u[counted], sign * weights[counted] / number, question.compile)
    return {
        "probability": probability,
        "derivatives": score() if slopes else {},
        "error": error,
        "confidence": interval(probability, error),
        "samples": number,
        "failed": lost,
        "faults": (*lost_samples(lost, number), *few),
    }


def _centres(points: DesignPoint, system: str) -> np.ndarray:
    """Points (k, n) about which failures are likely: the design points, or of a system in parallel the nearest point
    that fails by all tangents.

    Source: Lawson and Hanson 1974, Solving Least Squares Problems, 23.4 (least distance programming).
    """
    if system == "series" or len(points.u) < 2:
        return points.u
    from scipy.optimize import nnls

    normals = -points.gradient / np.linalg.norm(points.gradient, axis=1, keepdims=True)
    E = np.column_stack([normals, np.sum(normals * points.u, axis=1)]).T
    one = np.zeros(len(E))
    one[-1] = 1.0
    left = E @ nnls(E, one)[0] - one
    return points.u if left[-1] > -1e-8 else -left[None, :-1] / left[-1]


def _mixture(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Centres (k + 1, n), standard deviations and shares (k + 1,) of the normal densities that samples are of."""
    k, n = points.shape
    spread = max(1.0, float(np.min(np.linalg.norm(points, axis=1))) / np.sqrt(n))
    centres = np.concatenate([points, np.zeros((1, n))])
    spreads, shares = np.append(np.ones(k), spread), np.append(np.full(k, (1.0 - _ELSEWHERE) / k), _ELSEWHERE)
    return centres, spreads, shares


def _log_density(u: np.ndarray, centres: np.ndarray, spreads: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Logarithm of the density of a mixture at points u (samples, n), without the factor that normal densities
    share."""
    squares = np.sum((u[:, None] - centres) ** 2, axis=2)
    return logsumexp(-0.5 * squares / spreads**2 - u.shape[1] * np.log(spreads), axis=1, b=shares)


_FEW = "the standard error is more than 0.3 of the probability: take more samples"


def failures(values: np.ndarray, system: str) -> np.ndarray:
    """True (k,) for samples (k, m) that fail; what has no number fails."""
    failed = ~(values > 0.0)
    return np.any(failed, axis=1) if system == "series" else np.all(failed, axis=1)


def interval(probability: float, error: float, width: float = _NORMAL_95) -> tuple[float, float]:
    """The interval (of 95 %) of a probability with a standard error: of its logarithm, which is nearly normal; above
    a half of that of its complement."""
    if probability > 0.5:
        low, high = interval(1.0 - probability, error, width)
        return 1.0 - high, 1.0 - low
    if not probability > 0.0:
        return 0.0, float("nan")
    factor = float(np.exp(width * error / probability))
    return probability / factor, min(probability * factor, 1.0)


def lost_samples(lost: int, number: int) -> tuple[str, ...]:
    """A sentence where samples gave no number."""
    return (f"{lost} of {number} samples gave no number; they count as failures",) * bool(lost)


def score_slopes(variables: RandomVariables, u: np.ndarray, weights: np.ndarray, compile: str) -> dict:
    """Derivatives of the sum of weights (k,) of failures at points (k, n), by parameter."""
    flat, unravel = ravel_pytree(variables)

    def total(flat, u, weights):
        each = jax.vmap(lambda u: log_density(unravel(flat), variables, u))(u)
        return jnp.sum(weights * each)

    if not len(u):
        return {}
    size = 2 ** int(np.ceil(np.log2(len(u))))  # few programs for any number of failures
    u = np.concatenate([u, np.zeros((size - len(u), u.shape[1]))])
    weights = np.concatenate([weights, np.zeros(size - len(weights))])
    slopes = jit(lambda f, u, w: parameter_slopes(variables, unravel(jax.grad(total)(f, u, w))), compile=compile)
    return named_slopes(variables, slopes(flat, u, weights))
