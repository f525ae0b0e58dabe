"""The bound formulation of the largest of many numbers.

It has a kink wherever another number becomes the largest, and its minimum usually lies there: a search by slopes
stops at the first.  So the largest is a variable of its own, the bound z, which is minimised subject to `v_i <= z`
for each number: smooth, and exact.  Source: Nocedal and Wright, Numerical Optimization (2006), 12.1.
"""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from ._limit import Limit
from ._optimum import History, Optimum
from ._variables import Variables
from ._worst import Worst

#: The answer, beside those of the user, that has the numbers over the bound.
_ANSWER = "numbers over the bound of design.Worst"
#: Unit of the numbers, over the largest size among them, where the largest number itself is near zero.
_LEAST_UNIT = 1e-3


def bound_formulation(worst: Worst, limits: Sequence[Limit]) -> tuple[Callable, tuple[Limit, ...]]:
    """Objective and limits as functions of (design, bound, unit), the bound in units of the numbers."""

    def objective(x):
        design, bound, unit = x
        numbers, answers = worst.numbers(design)
        return bound, {**(answers or {}), _ANSWER: numbers / unit - bound}

    def of_design(limit):
        if not callable(limit.value):
            return limit
        value, variables = limit.value, limit.variables
        if callable(variables):
            of_limit = variables
            variables = lambda x: of_limit(x[0])
        return dataclasses.replace(limit, value=lambda x, *numbers: value(x[0], *numbers), variables=variables)

    own = Limit(worst.name, _ANSWER, upper=0.0, scale=1.0)
    return objective, (own, *(of_design(limit) if isinstance(limit, Limit) else limit for limit in limits))


def with_bound(variables: Variables) -> Variables:
    """Variables (design, bound, unit), of which the unit is fixed; the bound begins at zero."""
    ends = np.array([-np.inf, 1.0]), np.array([np.inf, 1.0])
    parts = zip(variables[1:5], (np.array([0.0, 1.0]), *ends, np.ones(2)), strict=True)
    start, lower, upper, scale = (np.concatenate(pair) for pair in parts)
    names = (*variables.names, "bound", "unit")
    return Variables(names, start, lower, upper, scale, lambda x: (variables.unravel(x[:-2]), x[-2], x[-1]))


def at_largest(variables: Variables, numbers: np.ndarray) -> Variables:
    """Variables whose bound begins at the largest of the numbers at their start, which is its unit."""
    largest = float(np.max(numbers))
    unit = max(abs(largest), _LEAST_UNIT * float(np.max(np.abs(numbers)))) or 1.0
    start, lower, upper, scale = (np.array(part) for part in variables[1:5])
    start[-2:], lower[-1], upper[-1], scale[-1] = (largest / unit, unit), unit, unit, unit
    return variables._replace(start=start, lower=lower, upper=upper, scale=scale)


def without_bound(optimum: Optimum) -> Optimum:
    """The result in terms of the design and the numbers alone."""
    own, *others = optimum.limits
    (design, bound, unit), (initial, first, _) = optimum.design, optimum.initial_design
    bound, unit, first = (float(x) for x in (bound, unit, first))
    before, after = unit * (own.before + first), unit * (own.after + bound)
    value = float(np.max(after))
    limit = own._replace(before=before, after=after, bound=value)
    others = [each._replace(prices=unit * each.prices) for each in others]
    values, norms, evaluations = optimum.history
    prices, kkt = optimum.bound_prices, optimum.kkt
    return dataclasses.replace(
        optimum,
        design=design,
        value=value if np.isfinite(optimum.value) else optimum.value,
        initial_design=initial,
        initial_value=float(np.max(before)),
        history=History(unit * values, unit * norms, evaluations),
        lower=optimum.lower[:-2],
        upper=optimum.upper[:-2],
        names=optimum.names[:-2],
        limits=(limit, *others),
        bound_prices=None if prices is None else unit * prices[:-2],
        kkt=None if kkt is None else unit * kkt,
    )
