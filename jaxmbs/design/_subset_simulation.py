"""Subset simulation: a small probability as a product of larger ones, level by level, without gradients."""

from typing import Any

import numpy as np
from scipy.special import ndtri

from ..probability import RandomVariables
from ._importance_sampling import interval, lost_samples, score_slopes
from ._limit_state import LimitState
from ._reliability_result import Reliability

_SHARE = 0.1  # of the samples of a level that begin the next one
_LEVELS = 20  # at most: probabilities down to 1e-20


def subset_simulation(traced: LimitState, variables: RandomVariables, question: Any) -> Reliability:
    """Probability by subset simulation; its confidence is by the correlation of the samples within chains.

    Source: Au and Beck 2001, Estimation of small failure probabilities in high dimensions by subset simulation;
    Papaioannou, Betz, Zwirglmaier and Straub 2015, MCMC algorithms for subset simulation (conditional sampling).
    """
    rng = np.random.default_rng(question.seed)
    n, seeds = len(variables.names), max(int(round(_SHARE * question.samples)), 1)
    steps = int(np.ceil(question.samples / seeds))
    number, total = seeds * steps, seeds * steps * (_LEVELS + 3)
    evaluate = lambda u: _level_values(traced.sampled(u, variables, question.compile, total), question.system)
    u = rng.normal(size=(number, n))
    g, lost = evaluate(u)
    probability, variance, count, spread = 1.0, 0.0, number, 0.6
    chains = np.arange(number)[:, None]  # independent samples are chains of one
    for _ in range(_LEVELS):
        level = max(0.0, float(np.partition(g, seeds - 1)[seeds - 1]))
        inside = g <= level
        share = float(np.mean(inside))
        probability, variance = probability * share, variance + _relative_variance(inside, chains)
        if level <= 0.0 or share >= 1.0:
            break
        first = np.flatnonzero(inside)[np.argsort(g[inside], kind="stable")[:seeds]]
        u, g, more, spread = _chains(rng, u[first], g[first], level, steps, spread, evaluate)
        chains = np.arange(number).reshape(steps, seeds).T
        lost, count = lost + more, count + number - seeds
    reached = level <= 0.0
    probability = probability if reached else np.nan
    error = probability * np.sqrt(variance)
    inside = g <= 0.0
    faults: tuple[str, ...] = (
        f"no failure was found in {_LEVELS} levels: the probability is below {_SHARE:g}^{_LEVELS}",
    )
    if reached:
        faults, more = _missed_failures(rng, evaluate, (2 * number, n), probability, error)
        lost, count = lost + more, count + 2 * number
    counted, part = (inside, probability) if not probability > 0.5 else (~inside, probability - 1.0)
    size = max(np.sum(counted), 1)
    slopes = score_slopes(variables, u[counted], np.full(np.sum(counted), part / size), question.compile)
    return Reliability(
        probability, float(-ndtri(probability)), {}, {}, slopes if reached else {}, "subset", np.zeros((0, n)),
        np.zeros(0), error=error, confidence=interval(probability, error), samples=count, failed=lost,
        faults=(*faults, *lost_samples(lost, count)),
    )  # fmt: skip


def _missed_failures(rng, evaluate, shape, probability, error):
    """A sentence where samples all around find failures that the chains have missed, and how many had no number.

    Normal samples as wide as the failures are far, with weights: where they are few of the failures they find fewer,
    so that only more of them says something.  Both intervals of 95 % are apart by chance in one of some 300 runs.
    """
    far = float(ndtri(probability))
    wide = np.sqrt(1.0 + far**2 / shape[1])
    u = wide * rng.normal(size=shape)
    g, lost = evaluate(u)
    logs = shape[1] * np.log(wide) - 0.5 * (1.0 - wide**-2) * np.sum(u * u, axis=1)
    weights = np.where(g <= 0.0, np.exp(logs), 0.0)
    mean, deviation = float(np.mean(weights)), float(np.std(weights) / np.sqrt(len(u)))
    low, high = interval(mean, deviation)
    # a few failures of large weights, as a hundred variables have them, say nothing: their interval is too narrow
    if deviation > 0.3 * mean or low <= interval(probability, error)[1]:
        return (), lost
    return (f"chains have missed failures: samples all around give {low:.3g} to {high:.3g}",), lost


def _level_values(values, system):
    """One number for each sample (k, m), which is zero or less where the system fails, and how many had none."""
    lost = ~np.all(np.isfinite(values), axis=1)
    values = np.where(np.isfinite(values), values, -np.inf)
    return np.min(values, axis=1) if system == "series" else np.max(values, axis=1), int(np.sum(lost))


def _chains(rng, u, g, level, steps, spread, evaluate):
    """Samples below a level, as Markov chains from the first ones; the correlation of the steps is such that four in
    nine are taken."""
    points, values, lost = [u], [g], 0
    for _ in range(steps - 1):
        trial = np.sqrt(1.0 - spread**2) * points[-1] + spread * rng.normal(size=u.shape)
        found, more = evaluate(trial)
        taken = found <= level
        points.append(np.where(taken[:, None], trial, points[-1]))
        values.append(np.where(taken, found, values[-1]))
        lost += more
        spread = float(np.clip(spread * np.exp(0.5 * (np.mean(taken) - 0.44)), 0.02, 1.0))
    return np.concatenate(points), np.concatenate(values), lost, spread


def _relative_variance(inside, chains):
    """Squared coefficient of variation of the share of samples inside, of chains (seeds, steps).

    Source: Au and Beck 2001, (29).
    """
    seeds, steps = chains.shape
    share, marks = float(np.mean(inside)), inside[chains].astype(float) - np.mean(inside)
    if not 0.0 < share < 1.0:
        return 0.0
    whole = np.mean(marks**2)
    lagged = [np.sum(marks[:, k:] * marks[:, : steps - k]) / (seeds * (steps - k)) / whole for k in range(1, steps)]
    gamma = 2.0 * sum((1.0 - k / steps) * rho for k, rho in enumerate(lagged, 1))
    return (1.0 - share) / (share * inside.size) * (1.0 + max(gamma, 0.0))
