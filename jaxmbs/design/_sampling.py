"""Probability of failure by plain samples of the random numbers."""

from typing import Any

import numpy as np
from scipy.special import ndtri

from ..probability import RandomVariables
from ._importance_sampling import failures, interval, lost_samples, score_slopes
from ._limit_state import LimitState
from ._reliability_result import Reliability

_PART = 100_000  # samples that are drawn at a time
_FEWEST = 10  # failures, and designs that hold, from which their number says something


def plain_sampling(traced: LimitState, variables: RandomVariables, question: Any) -> Reliability:
    """Share of failures among samples; what has no number fails."""
    rng = np.random.default_rng(question.seed)
    number, n = question.samples, len(variables.names)
    parts, lost = {True: [np.zeros((0, n))], False: [np.zeros((0, n))]}, 0
    for begin in range(0, number, _PART):
        u = rng.normal(size=(min(_PART, number - begin), n))
        values = traced.sampled(u, variables, question.compile, number)
        is_failure = failures(values, question.system)
        parts[True].append(u[is_failure])
        parts[False].append(u[~is_failure])
        lost += int(np.sum(~np.all(np.isfinite(values), axis=1)))
    failed, holding = (np.concatenate(parts[key]) for key in (True, False))
    count = len(failed)
    # derivatives by the fewer ones: what fails nearly always says little by how it fails
    points, sign = (failed, 1.0) if count <= len(holding) else (holding, -1.0)
    probability = count / number
    error = float(np.sqrt(probability * (1.0 - probability) / number))
    few = (f"{count} of {number} samples failed: that says little, take more or another method",)
    is_few = min(count, number - count) < _FEWEST
    return Reliability(
        probability, float(-ndtri(probability)) if 0 < count < number else np.nan, {}, {},
        score_slopes(variables, points, np.full(len(points), sign / number), question.compile), "samples",
        np.zeros((0, n)), np.zeros(0),
        error=error, confidence=interval(probability, error), samples=number, failed=lost,
        faults=(*lost_samples(lost, number), *few * is_few),
    )  # fmt: skip
