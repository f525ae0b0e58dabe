"""`reliability`: the probability that a design fails, by design points or by samples."""

import dataclasses
import functools
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import ndtr, ndtri
from jax.scipy.stats import norm

from ..checks import count_faults, number_faults
from ..errors import ModelError
from ..probability import RandomVariables
from ..runtime import jit, kept_tiers
from ._bending import bent_points
from ._chaos_reliability import TOLERANCE, ChaosLimit, chaos_limit, far_from_failure
from ._design_point import (
    CONVERGED,
    MORE_STARTS,
    NOT_FINITE,
    DesignPoint,
    NearestFailure,
    find_design_point,
    first_points,
)
from ._distinct_points import distinct_points, unproven_points
from ._importance_sampling import NORMAL_999, importance_sampling, interval
from ._limit_state import LimitState, read_variables, scalar_limit, trace_limit_state
from ._parameter_slopes import importances, index_slopes, named_slopes, parameter_slopes
from ._polynomial_chaos import chaos_faults
from ._reliability_result import Reliability
from ._sampling import plain_sampling
from ._subset_simulation import subset_simulation
from ._system_probability import system_probability

METHODS = ("form", "sorm", "importance", "subset", "pce", "samples")
SYSTEMS = ("series", "parallel")


class ReliabilityOptions(NamedTuple):
    """Options of `reliability`."""

    method: str
    system: str
    starts: int | None
    samples: int
    seed: int
    tolerance: float
    steps: int
    compile: str


@kept_tiers()
def reliability(
    limit_state: Callable[[dict], Any],
    variables: Mapping[str, Any] | RandomVariables,
    method: str = "form",
    system: str = "series",
    starts: int | None = None,
    samples: int | None = None,
    seed: int = 0,
    tolerance: float = 1e-7,
    steps: int = 100,
    gradient: str = "reverse",
    compile: str = "auto",
) -> Reliability:
    """Probability that a function of random numbers is zero or less.

    Args:
        limit_state: of a dict of the variables to a number, positive where the design holds: `lambda x: strength -
            load(x)`; or to a row of numbers, one for each part of a system.  It is traced.
        variables: distributions by name (`mbs.probability`), or `RandomVariables` with correlations.
        method: "form": the limit state as its tangent at the design point, the most probable failure; some gradients.
            "sorm": with its curvatures, for as many gradients more as there are variables.  "importance": samples
            about the design point, with a confidence; "subset": samples level by level, without gradients, for limit
            states with kinks and many design points.  "pce": samples about the design points of a polynomial that is
            fitted to values and gradients (`polynomial_chaos`).  "samples": plain ones, for what is not rare.
        system: fails with any of its parts, "series", or with all of them, "parallel".
        starts: first points of each search, the medians and others around; those of different ends count as a series.
            By default the medians alone, and eight where no search from there finds a design point.
        samples: of "importance", default 10000; of each level of "subset", default 4000; of "pce" and of "samples",
            default 100000.  With "form" and "sorm" these samples about the design points are to confirm the
            probability, otherwise it is not `ok`: default 2000 values, without gradients; 0 for none, where they cost
            too much: no verdict is `ok` then.
        seed: of samples and starts.
        tolerance: of design points, relative to the index or to one.
        steps: gradients of a search, at most.
        gradient, compile: as of `minimise`.

    Raises: ModelError, TypeError, ValueError for what is none of these.

    Source: Ditlevsen and Madsen, Structural Reliability Methods (1996), 5 and 6; `importance_sampling`,
    `subset_simulation`.
    """
    _check(method, system, starts, samples, tolerance, steps)
    variables = read_variables(variables)
    traced = trace_limit_state(limit_state, variables, gradient, compile)
    default = {"importance": 10_000, "subset": 4_000, "pce": 100_000, "samples": 100_000}.get(method, 2_000)
    question = ReliabilityOptions(
        method, system, starts, default if samples is None else samples, seed, tolerance, steps, compile
    )
    if method == "subset":
        return subset_simulation(traced, variables, question)
    if method == "samples":
        return plain_sampling(traced, variables, question)
    if method == "pce":
        return _by_chaos(traced, variables, question)
    return _by_design_points(traced, variables, question)


def _by_design_points(
    traced: LimitState | ChaosLimit, variables: RandomVariables, question: ReliabilityOptions
) -> Reliability:
    """The question by first order, and what follows from its design points."""
    n = len(variables.names)
    search = jit(functools.partial(_search, traced, question), compile=question.compile)
    found = jax.tree.map(
        np.asarray, search(variables, jnp.asarray(first_points(n, question.starts or 1, question.seed)))
    )
    # without a number at the medians no side is known
    is_lost = ~np.isin(found.reason[:, 0], (CONVERGED, NOT_FINITE))
    if question.starts is None and np.any(is_lost):
        return _by_design_points(traced, variables, question._replace(starts=MORE_STARTS))
    points, which, faults = distinct_points(found, question.system)
    common: dict[str, Any] = {"method": question.method, "gradients": int(np.sum(found.evaluations))}
    if not len(points.u):
        none: dict = {}
        unknown = Reliability(np.nan, np.nan, none, none, none, points=points.u, indices=points.answer, **common)
        return dataclasses.replace(unknown, faults=faults)
    faults = (*faults, *unproven_points(traced, variables, points, which, question.compile))
    if question.method in ("form", "sorm"):
        faults = (*faults, *bent_points(traced, variables, points, which, question))
    first = jax.tree.map(lambda x: jnp.asarray(x[np.argmin(np.abs(points.answer))]), points)
    numbers, shares = jit(_at_design_point, compile=question.compile)(variables, first)
    common["design_point"] = {name: float(numbers[name]) for name in variables.names}
    common["importances"] = dict(zip(variables.names, np.asarray(shares, float).tolist(), strict=True))
    parts = _answers(traced, variables, points, which, question)
    return Reliability(
        index=-float(ndtri(parts["probability"])) if parts["probability"] > 0.0 else np.nan,
        points=points.u,
        indices=points.answer,
        faults=(*faults, *parts.pop("faults")),
        **common,
        **parts,
    )


def _by_chaos(traced: LimitState, variables: RandomVariables, question: ReliabilityOptions) -> Reliability:
    """The question to a polynomial in place of the limit state, by importance sampling."""
    surrogate = chaos_limit(traced, variables, question)
    found = _by_design_points(surrogate, variables, question._replace(method="importance"))
    faults = (*chaos_faults(surrogate.fit, TOLERANCE), *found.faults)
    if len(found.points):
        faults += far_from_failure(traced, surrogate, variables, found.points, question)
    error, count = float(np.max(surrogate.fit.error)), surrogate.fit.evaluations
    return dataclasses.replace(found, method="pce", gradients=count, surrogate_error=error, faults=faults)


def _answers(traced, variables, points, which, question) -> dict:
    """Probability, derivatives and what belongs to the method, as fields of the result."""
    if question.method == "importance":
        return importance_sampling(traced, variables, points, question)
    if question.method == "form" and len(points.u) == 1:
        found = _first_order(variables, points, question.compile)
    else:
        found = system_probability(traced, variables, points, which, question)
    if not question.samples:
        found["faults"] = (*found["faults"], "no samples confirm it")
        return found
    sampled = importance_sampling(traced, variables, points, question, slopes=False)
    found["faults"] = (*found["faults"], *sampled["faults"], *_unconfirmed(found["probability"], sampled))
    return found | {name: sampled[name] for name in ("error", "confidence", "samples", "failed")}


def _first_order(variables: RandomVariables, points: DesignPoint, compile: str) -> dict:
    """Probability of one limit state, and its derivatives, by the design point alone."""
    u, gradient, index = (jnp.asarray(part[0]) for part in (points.u, points.gradient, points.answer))
    density = float(norm.pdf(index))

    def slopes(variables):
        return parameter_slopes(variables, index_slopes(variables, u, gradient))

    rows = jit(slopes, compile=compile)(variables)
    derivatives = named_slopes(variables, rows, -density)
    return {"probability": float(ndtr(-index)), "derivatives": derivatives, "faults": ()}


def _unconfirmed(probability, sampled) -> tuple[str, ...]:
    """A sentence where samples do not confirm a probability: it is outside of their 99.9 % interval."""
    low, high = interval(sampled["probability"], sampled["error"], NORMAL_999)
    if low <= probability <= high:
        return ()
    if np.isnan(high):
        return (f"no sample about the design point fails, of a probability of {probability:.3g}",)
    return (f"samples about the design point give {low:.3g} to {high:.3g}, not {probability:.3g}",)


def _search(traced, question, variables, starts):
    """Design points (m, starts) of all limit states."""
    factor = variables.factor()

    def one(which, start):
        limit = scalar_limit(traced, variables, factor, which)
        return find_design_point(
            NearestFailure(limit), start, question.tolerance, question.steps, traced.reverse, False
        )

    if traced.size == 1 and len(starts) == 1:
        return jax.tree.map(lambda x: x[None, None], one(0, starts[0]))
    return jax.vmap(lambda k: jax.vmap(lambda start: one(k, start))(starts))(jnp.arange(traced.size))


def _at_design_point(variables, point):
    """The random numbers at a design point, and their importances."""
    return variables.from_normal(point.u), importances(variables, point.u, point.gradient)


def _check(method, system, starts, samples, tolerance, steps) -> None:
    """Raises: ModelError for options that do not exist or make no sense."""
    faults = count_faults("steps", steps, 1)
    faults += [] if starts is None else count_faults("starts", starts, 1)
    faults += [] if samples is None else count_faults("samples", samples)
    for what, value, known in (("method", method, METHODS), ("system", system, SYSTEMS)):
        if value not in known:
            faults.append(f"{what} must be one of {', '.join(map(repr, known))}, not {value!r}")
    if not faults and samples is not None and method not in ("form", "sorm") and samples < _FEWEST:
        faults.append(f"samples must be at least {_FEWEST} for the method {method!r}, not {samples}")
    faults += number_faults("tolerance", tolerance, positive=True)
    if faults:
        raise ModelError(faults, "the question")


_FEWEST = 100  # samples from which a probability can be said
