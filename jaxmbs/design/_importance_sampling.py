"""Importance sampling about design points, with its confidence."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree

from ..probability import RandomVariables
from ..runtime import jit
from ._design_point import DesignPoint
from ._limit_state import LimitState
from ._parameter_slopes import log_density, named_slopes, parameter_slopes

_NORMAL_95 = 1.959963984540054  # standard normal number of the two-sided 95 % interval


def importance_sampling(traced: LimitState, variables: RandomVariables, points: DesignPoint, question: Any) -> dict:
    """Probability by normal samples about the design points, as fields of a result; what has no number fails.

    Derivatives are by the density of the samples that fail (the score), without gradients of the limit state.

    Source: Melchers 1989, Importance sampling in structural systems.
    """
    rng = np.random.default_rng(question.seed)
    number, n = question.samples, points.u.shape[1]
    centres = points.u[rng.integers(len(points.u), size=number)]
    u = centres + rng.normal(size=(number, n))
    values = traced.sampled(u, variables, question.compile, number)
    is_failure = failures(values, question.system)
    distances = -0.5 * np.sum((u[:, None] - points.u) ** 2, axis=2)
    largest = np.max(distances, axis=1)
    log_mixture = largest + np.log(np.mean(np.exp(distances - largest[:, None]), axis=1))
    weights = np.where(is_failure, np.exp(-0.5 * np.sum(u**2, axis=1) - log_mixture), 0.0)
    probability, error = float(np.mean(weights)), float(np.std(weights, ddof=1) / np.sqrt(number))
    lost = int(np.sum(~np.all(np.isfinite(values), axis=1)))
    return {
        "probability": probability,
        "derivatives": score_slopes(variables, u[is_failure], weights[is_failure] / number),
        "error": error,
        "confidence": interval(probability, error),
        "samples": number,
        "failed": lost,
        "faults": (*lost_samples(lost, number), *([] if error < 0.3 * probability else [_FEW])),
    }


_FEW = "the standard error is more than 0.3 of the probability: take more samples"


def failures(values: np.ndarray, system: str) -> np.ndarray:
    """True (k,) for samples (k, m) that fail; what has no number fails."""
    failed = ~(values > 0.0)
    return np.any(failed, axis=1) if system == "series" else np.all(failed, axis=1)


def interval(probability: float, error: float, width: float = _NORMAL_95) -> tuple[float, float]:
    """The interval (of 95 %) of a probability with a standard error: of its logarithm, which is nearly normal."""
    if not probability > 0.0:
        return 0.0, float("nan")
    factor = float(np.exp(width * error / probability))
    return probability / factor, min(probability * factor, 1.0)


def lost_samples(lost: int, number: int) -> tuple[str, ...]:
    """A sentence where samples gave no number."""
    return (f"{lost} of {number} samples gave no number; they count as failures",) * bool(lost)


def score_slopes(variables: RandomVariables, u: np.ndarray, weights: np.ndarray) -> dict:
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
    slopes = jit(lambda f, u, w: parameter_slopes(variables, unravel(jax.grad(total)(f, u, w))))(flat, u, weights)
    return named_slopes(variables, slopes)
