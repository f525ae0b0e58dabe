"""Probability of failure by plain samples of the random numbers."""

from typing import Any

import numpy as np
from scipy.special import ndtri

from ..probability import RandomVariables
from ._importance_sampling import failures, interval, lost_samples, score_slopes
from ._limit_state import LimitState
from ._reliability_result import Reliability

_PART = 100_000  # samples that are drawn at a time
_FEWEST = 10  # failures from which their number says something


def plain_sampling(traced: LimitState, variables: RandomVariables, question: Any) -> Reliability:
    """Share of failures among samples; what has no number fails."""
    rng = np.random.default_rng(question.seed)
    number, n = question.samples, len(variables.names)
    failed, lost = [np.zeros((0, n))], 0
    for begin in range(0, number, _PART):
        u = rng.normal(size=(min(_PART, number - begin), n))
        values = traced.sampled(u, variables, question.compile, number)
        failed.append(u[failures(values, question.system)])
        lost += int(np.sum(~np.all(np.isfinite(values), axis=1)))
    points = np.concatenate(failed)
    count = len(points)
    probability = count / number
    error = float(np.sqrt(probability * (1.0 - probability) / number))
    few = (f"{count} of {number} samples failed: that says little, take more or another method",)
    return Reliability(
        probability, float(-ndtri(probability)) if 0 < count < number else np.nan, {}, {},
        score_slopes(variables, points, np.full(count, 1.0 / number), question.compile), "samples",
        np.zeros((0, n)), np.zeros(0),
        error=error, confidence=interval(probability, error), samples=number, failed=lost,
        faults=(*lost_samples(lost, number), *few * (count < _FEWEST)),
    )  # fmt: skip
