"""Verdict on limits with a probability at the end of a search: samples confirm their percentiles, or not."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ._limit import Limit
from ._limit_result import LimitResult
from ._optimum import Optimum
from ._reliability_result import Reliability

_CURE = "ask for a smaller one until Limit.reliability of the design confirms it"


def judge_chances(found: Optimum, limits: Sequence[Limit], compile: str) -> Optimum:
    """The optimum, not `ok` where samples do not confirm the probability of a limit at it.

    A percentile is that of a plane, and the search for its point may end at one of several or at a kink: designs that
    fail in half of all cases would be called optima.
    """
    for limit in limits:
        if found.ok and limit.probability is not None:
            doubt = _doubt(limit, found.limit(limit.name), found.design, compile)
            found = dataclasses.replace(found, reason=doubt or found.reason)
    return found


def _doubt(limit: Limit, at_end: LimitResult, design: Any, compile: str) -> str:
    """A sentence about a limit that samples do not confirm; empty where they do."""
    options: dict[str, Any] = {"samples": limit.samples, "compile": compile}
    drawn: Reliability = limit.reliability(design, "form", **options)
    if np.isnan(drawn.probability) and limit.samples:  # no slope leads to failure: samples about no point
        drawn = limit.reliability(design, "samples", **options | {"samples": max(limit.samples, 100)})
    assert limit.probability is not None
    if drawn.confidence is not None and drawn.confidence[0] > limit.probability * at_end.after.size:
        low, high = drawn.confidence
        return (
            f"limit {limit.name!r} is passed with a probability of {low:.3g} to {high:.3g} by samples, not of "
            f"{limit.probability:g}: its percentile is of the first order; {_CURE}"
        )
    if at_end.active and drawn.faults and (at_end.after.size == 1 or not limit.samples):
        return f"the probability of limit {limit.name!r} is not confirmed: {drawn.faults[0]}; {_CURE}"
    return ""
