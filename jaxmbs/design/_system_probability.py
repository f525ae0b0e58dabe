"""Probability of several design points together, as a system in series or in parallel."""

import functools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.flatten_util import ravel_pytree
from jax.scipy.special import ndtr, ndtri

from ..probability import RandomVariables
from ..probability._normal_integrals import all_below, any_above
from ..runtime import jit
from ._design_point import DesignPoint, NearestFailure, find_design_point
from ._limit_state import LimitState, scalar_limit
from ._parameter_slopes import named_slopes, parameter_slopes
from ._second_order import SecondOrder, curvature_matrix, second_order


def system_probability(
    traced: LimitState, variables: RandomVariables, points: DesignPoint, which: np.ndarray, question: Any
) -> dict:
    """Probability of the system, of first or second order, its derivatives and bounds, as fields of a result.

    Each limit state is its tangent, or of second order the plane with its probability; all of them together are
    correlated normal numbers.  Derivatives are through the design points, by the implicit function theorem.

    Source: Hohenbichler and Rackwitz 1983, First-order concepts in system reliability.
    """
    starts = jnp.asarray(points.u)
    of_system = functools.partial(_of_system, traced, question, starts, which)
    flat, unravel = ravel_pytree(variables)

    def with_slopes(flat):
        function = lambda flat: of_system(unravel(flat))
        if traced.reverse:
            value, pull, parts = jax.vjp(function, flat, has_aux=True)
            slopes = pull(jnp.ones_like(value))[0]
        else:
            slopes, (value, parts) = jax.jacfwd(lambda flat: _twice(*function(flat)), has_aux=True)(flat)
        return value, parts, parameter_slopes(variables, unravel(slopes))

    value, parts, rows = jit(with_slopes, compile=question.compile)(flat)
    indices, correlation, second = parts
    found: dict[str, Any] = {"probability": float(value), "faults": ()}
    found["derivatives"] = named_slopes(variables, rows)
    if len(which) > 1:
        found["bounds"] = system_bounds(np.asarray(indices), np.asarray(correlation), question.system)
    elif question.method == "sorm":
        found |= _by_name(second)
    if not np.isfinite(found["probability"]):
        found["faults"] = ("the limit state bends about the medians: its design point is not the nearest failure",)
    return found


def _twice(value, parts):
    return value, (value, parts)


def _of_system(traced, question, starts, which, variables):
    """Probability (), and indices and correlation of the parts; of the second order what is known of the last one."""
    factor, second = variables.factor(), None
    indices, normals = [], []
    for start, row in zip(starts, which, strict=True):
        limit = scalar_limit(traced, variables, factor, int(row))
        steps = question.steps
        point = find_design_point(NearestFailure(limit), start, question.tolerance, steps, traced.reverse, False)
        index = point.answer
        if question.method == "sorm":
            second = second_order(index, curvature_matrix(limit, point, traced.reverse))
            index = -ndtri(second.tvedt)
        indices.append(index)
        normals.append(-point.gradient / jnp.sqrt(point.gradient @ point.gradient))
    b, A = jnp.stack(indices), jnp.stack(normals)
    correlation = A @ A.T
    if len(indices) == 1 and second is not None:
        return second.tvedt, (b, correlation, second)
    value = any_above(b, correlation) if question.system == "series" else all_below(-b, correlation)
    return value, (b, correlation, None)


def system_bounds(indices: np.ndarray, correlation: np.ndarray, system: str) -> tuple[float, float]:
    """Least and largest probability (Ditlevsen's bounds of a series), by parts and pairs of parts.

    Source: Ditlevsen 1979, Narrow reliability bounds for structural systems.
    """
    order = np.argsort(indices)
    P = np.asarray(ndtr(-jnp.asarray(indices)))[order]
    if system == "parallel":
        return max(0.0, float(np.sum(P)) - len(P) + 1.0), float(np.min(P))
    pairs = _pair_probabilities(indices[order], correlation[np.ix_(order, order)])
    least = P[0] + sum(max(0.0, P[k] - float(np.sum(pairs[k, :k]))) for k in range(1, len(P)))
    largest = float(np.sum(P)) - sum(float(np.max(pairs[k, :k])) for k in range(1, len(P)))
    return float(least), largest


def _pair_probabilities(indices, correlation):
    """Probabilities (k, k) that two parts fail."""

    def both(one: Array, other: Array, rho: Array) -> Array:
        return all_below(-jnp.stack([one, other]), jnp.stack([jnp.stack([1.0, rho]), jnp.stack([rho, 1.0])]))

    over = jax.vmap(jax.vmap(both, (None, 0, 0)), (0, None, 0))
    return np.asarray(jit(over)(jnp.asarray(indices), jnp.asarray(indices), jnp.asarray(correlation)))


def _by_name(second: SecondOrder) -> dict:
    """Curvatures (n - 1,), the largest first, without the zero of the point's direction; and the probabilities."""
    values = np.asarray(second.curvatures)
    principal = np.delete(values, np.argmin(np.abs(values)))
    return {
        "curvatures": np.sort(principal)[::-1],
        "second_order": {name: float(getattr(second, name)) for name in ("tvedt", "breitung", "hohenbichler")},
    }
