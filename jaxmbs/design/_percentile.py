"""`percentile`: the value of an answer that random numbers pass with a given probability, of the first order."""

from collections.abc import Callable, Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array
from jax.scipy.special import ndtri

from ..checks import any_concrete, count_faults, is_concrete, number_faults
from ..errors import ModelError
from ..probability import RandomVariables
from ..runtime import jit, not_tracing
from ._design_point import CONVERGED, MORE_STARTS, WorstAtDistance, find_design_point, first_points
from ._limit_state import read_variables


def percentile(
    function: Callable[[dict], Any],
    variables: Mapping[str, Any] | RandomVariables,
    percent: Any,
    tolerance: float = 1e-7,
    steps: int = 100,
    gradient: str = "reverse",
    compile: str = "auto",
    starts: int | None = None,
) -> Array:
    """The value () that a function of random numbers lies below in `percent` per cent of all cases.

    The most probable point with that value is searched, as by "form" of `reliability` in reverse: some gradients, and
    exact where the function is a function of a sum of normal numbers.  It is a pure function with derivatives by what
    the function and the distributions close over, so that it makes a limit with a probability: `Limit("pin",
    lambda d: percentile(lambda x: load(d, x), spread(d), 99.9), upper=4e3)` holds but for one case in a thousand.

    Args:
        function: of a dict of the variables to a number.
        variables: as of `reliability`.
        percent: between 0 and 100.
        tolerance, steps, gradient, compile: as of `reliability`.
        starts: searches from the medians and from others around; the worst of their ends is the answer.  By default
            from the medians, and where that ends at no point from up to seven others, until one does.

    Returns: nan where the search did not end at a point.

    Source: Tu, Choi and Park 1999, A new study on reliability-based design optimization.

    Raises: ModelError, TypeError, ValueError for what is none of these.
    """
    variables = read_variables(variables)
    faults = number_faults("percent", percent, positive=True) + number_faults("tolerance", tolerance, positive=True)
    faults += [] if starts is None else count_faults("starts", starts, 1)
    if any_concrete(lambda x: x >= 100.0, percent):
        faults.append(f"percent must lie between 0 and 100, got {percent}")
    if gradient not in ("reverse", "forward"):
        faults.append(f"gradient must be 'reverse' or 'forward', not {gradient!r}")
    if faults:
        raise ModelError(faults, "the question")

    def solve(variables, percent):
        return _value(function, variables, percent, tolerance, steps, gradient == "reverse", starts)

    if not_tracing() and is_concrete(variables, percent):
        solve = jit(solve, compile=compile)
    return solve(variables, jnp.asarray(percent, float))


def _value(function, variables, percent, tolerance, steps, reverse, starts):
    """The largest value at a distance from the medians, or the least where less than half of the cases lie below."""
    distance = ndtri(percent / 100.0)
    side = jax.lax.stop_gradient(jnp.where(distance < 0.0, 1.0, -1.0))  # the search is for the least
    factor, names = variables.factor(), variables.names

    def limit(u):
        value = jnp.asarray(function(variables.from_normal(u, factor)), float)
        if value.ndim:
            raise TypeError(f"a percentile is that of one real number, the function returned shape {value.shape}")
        return side * value

    first = jnp.asarray(first_points(len(names), MORE_STARTS if starts is None else starts, 0))
    problem = WorstAtDistance(eqx.filter_closure_convert(limit, first[0]), jnp.abs(distance))
    found = find_design_point(problem, first, tolerance, steps, reverse, starts is not None)
    return side * jnp.where(found.reason == CONVERGED, found.answer, jnp.nan)
